/* Separable blur of a texture's level 0, in place, and the rest of its mip chain from it. */
#pragma once
#include "renderer/technique.h"

/* BLUR_MAX_RADIUS */
#define SHARED_ROWS "renderer/shaders/map/blur.def"
#include "renderer/shared/rows_c.h"

/* Weights of distance 0 to `radius` (texels) of a symmetric kernel that sums to 1 over 2 radius + 1
 * texels: a Gaussian whose standard deviation is half of radius + 1/2. */
void blur_weights(uint32_t radius, float weights[BLUR_MAX_RADIUS + 1]);

/* The levels above 0, of all layers: means of four texels each. `name` is the pass'. */
bool pass_mips(struct technique_ctx *ctx, const struct gl_texture *texture, const char *name,
    struct pen_error *error);

/* radius 0: mips only. The edge texel continues outside. Filterable float or normalised formats. */
bool pass_blur(struct technique_ctx *ctx, const struct gl_texture *texture, uint32_t radius,
    struct pen_error *error);
