/* A frame whose every value follows from its index, so that a reader in any language can tell what
 * a file must hold. */
#pragma once
#include "renderer/encode/encode.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static inline uint32_t pattern_bits(uint32_t index)
{
    uint32_t x = index * 2654435761u;
    x ^= x >> 15;
    x *= 2246822519u;
    return x ^ x >> 13;
}

/* RGBA8: 8 bits. RGBA16F: any 16 bits, so also NaN and infinities. RGBA32F: any 32 bits when `any`,
 * else display values that go a little beyond [0, 1], some of them not finite. */
static inline void pattern_plane(struct pen_plane *plane, const char *name, uint32_t pixel,
    uint32_t channels, size_t pixels, bool any)
{
    size_t samples = pixels * 4;
    memset(plane, 0, sizeof *plane);
    strncpy(plane->name, name, sizeof plane->name - 1);
    plane->pixel = pixel;
    plane->channels = channels;
    plane->data = malloc(samples * (pixel == PEN_PIXEL_RGBA8        ? 1
                                       : pixel == PEN_PIXEL_RGBA16F ? 2
                                                                    : 4));
    for (size_t i = 0; i < samples; i++) {
        uint32_t bits = pattern_bits((uint32_t)i);
        if (pixel == PEN_PIXEL_RGBA8) {
            ((uint8_t *)plane->data)[i] = (uint8_t)bits;
        } else if (pixel == PEN_PIXEL_RGBA16F) {
            ((uint16_t *)plane->data)[i] = (uint16_t)bits;
        } else if (any) {
            ((uint32_t *)plane->data)[i] = bits;
        } else {
            float value = (float)((bits & 0xffff) / 60000.0 - 0.05);
            if (i % 97 == 5)
                value = NAN;
            if (i % 97 == 6)
                value = INFINITY;
            if (i % 97 == 7)
                value = -INFINITY;
            ((float *)plane->data)[i] = value;
        }
    }
}

static inline void pattern_finish(struct pen_frame *frame)
{
    for (uint32_t p = 0; p < frame->plane_count; p++)
        free(frame->planes[p].data);
    *frame = (struct pen_frame){0};
}
