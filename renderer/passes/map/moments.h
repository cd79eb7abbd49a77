/* Prefiltered moment maps: what a depth map's texels say about depth, averaged, so that a shadow
 * lookup is one filtered fetch. Depth is linear, 0 at near_z and 1 at far_z. */
#pragma once
#include "renderer/passes/map/shadow_cache.h"

enum moment_kind {
    MOMENTS_VARIANCE,    /* RG32F: z and z^2, with the variance of a plane inside the texel */
    MOMENTS_EXPONENTIAL, /* RGBA32F: both warps of 2 z - 1, and their squares */
    MOMENTS_FOUR,        /* RGBA32F: packed moments 1 to 4 of 2 z - 1, see moments.glsl */
    MOMENTS_FOUR_UNORM,  /* the same, RGBA16 */
};

struct moment_map {
    uint32_t kind;      /* enum moment_kind */
    uint32_t size;      /* of the depth map and of the result, texels per side */
    uint32_t blur;      /* radius of the kernel, texels, at most BLUR_MAX_RADIUS */
    float exponents[2]; /* of the warps */
};

/* The map with its mip chain in textures[0]. Kept between requests. */
const struct shadow_input *pass_moments(
    struct technique_run *run, const struct moment_map *map, struct pen_error *error);

/* pass_classify for a lookup in that map (moment_lookup.glsl). */
bool pass_moment_tiles(struct technique_run *run, const struct moment_map *map,
    const struct gl_texture **tiles, struct pen_error *error);
