/* The emitter as 64 or 256 points, one bit each (Schwarz and Stamminger 2007). The points below a
 * coordinate come from a table, so that any set of points costs the same: the bits of a rectangle
 * are four lookups. */
#pragma once
#include "renderer/gl/texture.h"

#define LIGHT_BITS_STEPS 512   /* of a coordinate from -1 to 1 */
#define LIGHT_BITS_PATTERNS 16 /* jittered sets, one per pixel of a 4 x 4 block */

struct light_bits {
    struct gl_texture below; /* RG32UI or RGBA32UI array, (step, 2 pattern + axis, 128 bits) */
    struct gl_texture at;    /* RG32F, (point, pattern): emitter coordinates */
    uint32_t count, shape;
    bool jittered;
};

/* Makes *bits hold `count` (64 or 256) points over `shape` (enum light_shape): the centres of a
 * square grid, or LIGHT_BITS_PATTERNS sets of which each has one point in every cell, row and
 * column (a Hammersley net with scrambled digits). A disk gets them by the concentric map of
 * Shirley and Chiu 1997. */
void light_bits_fit(struct light_bits *bits, uint32_t count, uint32_t shape, bool jittered);
void light_bits_finish(struct light_bits *bits);
