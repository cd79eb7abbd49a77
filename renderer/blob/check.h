/* Shared by the files that check a blob; private to renderer/blob. */
#pragma once
#include "renderer/blob/pscene.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PSC_MAX_SIDE 16384u /* px; what GL 4.5 software and hardware both take */
#define PSC_MAX_INDICES (1u << 31)

#define DAMAGED(error, ...) pen_fail(error, PEN_INVALID, "", "Damaged scene file: " __VA_ARGS__)

/* True when `count` floats are neither infinite nor NaN; integer tests, so that it vectorises. */
static inline bool all_finite(const void *floats, size_t count)
{
    const char *bytes = floats;
    uint32_t bad = 0;
    for (size_t i = 0; i < count; i++) {
        uint32_t bits;
        memcpy(&bits, bytes + 4 * i, 4);
        bad |= (bits & 0x7f800000u) == 0x7f800000u;
    }
    return !bad;
}

/* Levels of a complete mip chain and their bytes (RGBA8). */
static inline uint32_t mip_levels(uint32_t width, uint32_t height)
{
    uint32_t levels = 1;
    for (uint32_t side = width > height ? width : height; side > 1; side >>= 1)
        levels++;
    return levels;
}

static inline uint64_t mip_chain_bytes(uint32_t width, uint32_t height)
{
    uint64_t bytes = 0;
    for (;;) {
        bytes += 4ull * width * height;
        if (width == 1 && height == 1)
            return bytes;
        width = width > 1 ? width / 2 : 1;
        height = height > 1 ? height / 2 : 1;
    }
}

/* Determinant of the linear part of a row-major 3x4 matrix. */
static inline double world_determinant(const float m[12])
{
    return (double)m[0] * ((double)m[5] * m[10] - (double)m[6] * m[9]) -
           (double)m[1] * ((double)m[4] * m[10] - (double)m[6] * m[8]) +
           (double)m[2] * ((double)m[4] * m[9] - (double)m[5] * m[8]);
}

/* True when every index, meshlet, primitive and instance of the scene is in range and finite. */
bool psc_check_geometry(const struct psc_scene *scene, struct pen_error *error);
/* The same of what moves, against a scene whose geometry passed. */
bool psc_check_motion(const struct psc_scene *scene, struct pen_error *error);
