/* Depth layers of the casters, nearest first (depth peeling, Everitt 2001). */
#pragma once
#include "renderer/passes/map/shadow_cache.h"

#define PEEL_MAX_LAYERS 4

/* Texture units of methods that walk these layers. */
#define SHARED_ROWS "renderer/shaders/lookup/patches.def"
#include "renderer/shared/rows_c.h"

/* textures[0]: D32F array of `layers` maps, size x size, without backdrops; the first is
 * pass_caster_map's. textures[1]: RGBA32F array with min, max and mean of each layer's hardware
 * depth over 2^k x 2^k texels, 1 beyond the map: level 0 has half the power of two that `size` is
 * or stays below as its side. For caster_patches.glsl. Kept between requests. */
const struct shadow_input *pass_caster_layers(
    struct technique_run *run, uint32_t size, uint32_t layers, struct pen_error *error);
