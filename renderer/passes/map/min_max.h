/* The min-max pyramid of a depth map. */
#pragma once
#include "renderer/passes/map/shadow_cache.h"

/* Min and max of linear z (metres from the light's plane; texels where nothing is: 1e30) over 2^k x
 * 2^k texels: RG32F with the whole mip chain in textures[0]; level 0 has half the map's side. */
const struct shadow_input *pass_min_max(
    struct technique_run *run, uint32_t size, struct pen_error *error);
/* The same over pass_caster_map. */
const struct shadow_input *pass_caster_min_max(
    struct technique_run *run, uint32_t size, struct pen_error *error);
/* Fills that pyramid from a depth map of size x size; the light block (near_z, far_z) is
 * bound. Cell i of level k is over texels i 2^(k + 1) and up; the last of a row takes what
 * is left over. */
bool pass_min_max_levels(struct technique_ctx *ctx, const struct gl_texture *depth, uint32_t size,
    const struct gl_texture *pyramid, struct pen_error *error);
