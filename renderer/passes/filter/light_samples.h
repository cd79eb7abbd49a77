/* Light samples with a shadow map each, looked up per pixel and left in scratch textures for a
 * filter (light_ratio.glsl). */
#pragma once
#include "renderer/passes/filter/penumbra.h"
#include "renderer/passes/light/sample_maps.h"

#define LIGHT_SAMPLES_MOST 64

/* Fills PENUMBRA_LIT and, under a textured light, PENUMBRA_ALL for this face's receivers; wants
 * pass_penumbra_spread first. `maps` points of the light are used, at most LIGHT_SAMPLES_MOST, of
 * which every pixel takes `per_pixel`: all of them, or, when fewer, P(samples) others than its
 * neighbours. */
bool pass_light_samples(struct technique_run *run, uint32_t maps, uint32_t map_size,
    uint32_t per_pixel, struct pen_error *error);
