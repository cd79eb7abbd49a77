#include "renderer/scene/emission_pattern.h"
#include <math.h>
#include <string.h>

/* In the order of pen_pattern_names. */
enum { TWO_COLOUR, CHECKER, STAINED_GLASS, STAR, CANDLE_FLAME, PATTERNS };

#define SUBSAMPLES 4 /* per axis and texel */
#define CANDLE_FRAMES 48

/* Colour at x, y in [-1, 1], y up. */
typedef void (*paint)(float x, float y, float phase, float rgb[3]);

static void set(float rgb[3], float r, float g, float b)
{
    rgb[0] = r, rgb[1] = g, rgb[2] = b;
}

static float smooth(float low, float high, float x)
{
    float t = (x - low) / (high - low);
    t = t < 0 ? 0 : t > 1 ? 1 : t;
    return t * t * (3 - 2 * t);
}

static void two_colour(float x, float y, float phase, float rgb[3])
{
    (void)y, (void)phase;
    set(rgb, x < 0, x >= 0, 0);
}

static void checker(float x, float y, float phase, float rgb[3])
{
    (void)phase;
    int square = (int)floorf(2 * x + 8) + (int)floorf(2 * y + 8);
    if (square & 1)
        set(rgb, 1, 0.42f, 0.04f);
    else
        set(rgb, 0.03f, 0.14f, 1);
}

static uint32_t scramble(uint32_t v)
{
    v = (v ^ v >> 16) * 0x7feb352du;
    v = (v ^ v >> 15) * 0x846ca68bu;
    return v ^ v >> 16;
}

/* Panes are the Voronoi cells of a jittered grid, with black lead between them. */
static void stained_glass(float x, float y, float phase, float rgb[3])
{
    static const float panes[][3] = {{0.9f, 0.04f, 0.03f}, {0.05f, 0.2f, 0.95f}, {1, 0.62f, 0.05f},
        {0.04f, 0.6f, 0.12f}, {0.55f, 0.08f, 0.7f}, {0.05f, 0.62f, 0.75f}, {0.95f, 0.9f, 0.75f}};
    const float cells = 2.5f; /* per unit */
    (void)phase;
    int cx = (int)floorf(x * cells), cy = (int)floorf(y * cells);
    float nearest = 1e9f, second = 1e9f;
    uint32_t pane = 0;
    for (int j = -2; j <= 2; j++)
        for (int i = -2; i <= 2; i++) {
            uint32_t h = scramble((uint32_t)(cx + i + 64) * 131u + (uint32_t)(cy + j + 64));
            float px = ((float)(cx + i) + 0.1f + 0.8f * (float)(h & 255) / 255) / cells;
            float py = ((float)(cy + j) + 0.1f + 0.8f * (float)(h >> 8 & 255) / 255) / cells;
            float d = hypotf(x - px, y - py);
            if (d < nearest) {
                second = nearest;
                nearest = d;
                pane = h >> 16;
            } else if (d < second) {
                second = d;
            }
        }
    const float *colour = panes[pane % (sizeof panes / sizeof *panes)];
    float frame = fmaxf(fabsf(x), fabsf(y)) > 0.97f;
    float lit = frame > 0 || second - nearest < 0.035f ? 0 : 1;
    set(rgb, colour[0] * lit, colour[1] * lit, colour[2] * lit);
}

static void star(float x, float y, float phase, float rgb[3])
{
    (void)phase;
    const float pi = 3.14159265f, tip = 0.97f, notch = 0.381966f * tip;
    float part = fabsf(remainderf(atan2f(x, y), 0.4f * pi)), r = hypotf(x, y);
    /* The edge runs straight from the tip to the notch 36 degrees beside it. */
    float nx = notch * sinf(0.2f * pi), ny = notch * cosf(0.2f * pi);
    float inside = nx * (r * cosf(part) - tip) - (ny - tip) * r * sinf(part) < 0;
    set(rgb, inside, inside, inside);
}

/* A drop that sways more the higher up, blue at the wick, white-yellow inside, orange outside. */
static void candle_flame(float x, float y, float phase, float rgb[3])
{
    const float turn = 6.2831853f;
    float tall = 1 + 0.06f * sinf(turn * (3 * phase)) + 0.04f * sinf(turn * (7 * phase + 0.3f));
    float up = (y + 0.9f) / (1.75f * tall); /* 0 at the foot, 1 at the tip */
    if (up <= 0 || up >= 1) {
        set(rgb, 0, 0, 0);
        return;
    }
    float sway =
        up * up * (0.16f * sinf(turn * (2 * phase)) + 0.07f * sinf(turn * (5 * phase + 0.2f))) +
        0.04f * up * sinf(turn * (4 * phase - 1.2f * up));
    float width = 0.62f * sqrtf(up) * powf(1 - up, 0.75f);
    float across = fabsf(x - sway) / fmaxf(width, 1e-4f);
    float glow = 1 - smooth(0.75f, 1, across), core = 1 - smooth(0.1f, 0.85f, across);
    float foot = 1 - smooth(0.02f, 0.25f, up), tip = smooth(0.55f, 1, up);
    core *= 1 - 0.6f * tip;
    set(rgb, glow * (1 - 0.9f * foot), glow * ((0.28f + 0.5f * core) * (1 - 0.75f * foot)),
        glow * (0.02f + 0.34f * core * (1 - foot) + 0.5f * foot));
}

static const paint paints[PATTERNS] = {two_colour, checker, stained_glass, star, candle_flame};

uint32_t emission_pattern_frames(uint32_t pattern)
{
    return pattern == CANDLE_FLAME ? CANDLE_FRAMES : 1;
}

void emission_pattern_draw(uint32_t pattern, uint32_t frame, uint32_t side, float (*rgb)[3])
{
    uint32_t fine = side * SUBSAMPLES;
    float phase = (float)(frame % CANDLE_FRAMES) / CANDLE_FRAMES;
    memset(rgb, 0, sizeof *rgb * side * side);
    for (uint32_t y = 0; y < fine; y++)
        for (uint32_t x = 0; x < fine; x++) {
            float c[3], *to = rgb[y / SUBSAMPLES * side + x / SUBSAMPLES];
            paints[pattern](2 * ((float)x + 0.5f) / (float)fine - 1,
                1 - 2 * ((float)y + 0.5f) / (float)fine, phase, c);
            for (int k = 0; k < 3; k++)
                to[k] += c[k] / (SUBSAMPLES * SUBSAMPLES);
        }
}
