#include "protocol/srgb.h"
#include "renderer/blob/geometry.h"
#include <math.h>
#include <pthread.h>
#include <stdlib.h>

#define STEPS 65536 /* of linear light: finer than an 8-bit sRGB step everywhere */

static float linear_of[256];
static uint8_t srgb_of[STEPS];

static void make_tables(void)
{
    for (int i = 0; i < 256; i++) {
        double s = i / 255.0;
        linear_of[i] = (float)pen_srgb_decode(s);
    }
    for (int i = 0; i < STEPS; i++) {
        double l = i / (STEPS - 1.0);
        srgb_of[i] = (uint8_t)(pen_srgb_encode(l) * 255 + 0.5);
    }
}

/* Source texels under destination texel `at`, and their weights, which sum to 1: two when the
 * source is even, three when it is odd (exact box filter), one when it is 1. */
static int box_taps(uint32_t source, uint32_t destination, uint32_t at, uint32_t *first, float w[3])
{
    double scale = (double)source / destination, begin = at * scale, end = begin + scale;
    *first = (uint32_t)begin;
    int taps = 0;
    for (uint32_t i = *first; i < source && i < end - 1e-9 && taps < 3; i++)
        w[taps++] = (float)((fmin(end, i + 1.0) - fmax(begin, i)) / scale);
    return taps;
}

static void halve(const uint8_t *from, uint32_t width, uint32_t height, uint8_t *to, uint32_t w,
    uint32_t h, bool srgb)
{
    for (uint32_t y = 0; y < h; y++) {
        uint32_t y0, x0;
        float wy[3], wx[3];
        int rows = box_taps(height, h, y, &y0, wy);
        for (uint32_t x = 0; x < w; x++) {
            int columns = box_taps(width, w, x, &x0, wx);
            float sum[4] = {0};
            for (int j = 0; j < rows; j++)
                for (int i = 0; i < columns; i++) {
                    const uint8_t *texel = from + 4 * ((size_t)(y0 + j) * width + x0 + i);
                    for (int k = 0; k < 4; k++)
                        sum[k] += wy[j] * wx[i] *
                                  (srgb && k < 3 ? linear_of[texel[k]] : texel[k] / 255.0f);
                }
            uint8_t *texel = to + 4 * ((size_t)y * w + x);
            for (int k = 0; k < 4; k++) {
                float v = fminf(sum[k], 1);
                texel[k] = srgb && k < 3 ? srgb_of[(int)(v * (STEPS - 1) + 0.5f)]
                                         : (uint8_t)(v * 255 + 0.5f);
            }
        }
    }
}

void psc_make_mips(uint8_t *texels, uint32_t width, uint32_t height, bool srgb)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT; /* builders of several threads share them */
    pthread_once(&once, make_tables);
    while (width > 1 || height > 1) {
        uint32_t w = width > 1 ? width / 2 : 1, h = height > 1 ? height / 2 : 1;
        uint8_t *next = texels + 4 * (size_t)width * height;
        halve(texels, width, height, next, w, h, srgb);
        texels = next;
        width = w;
        height = h;
    }
}
