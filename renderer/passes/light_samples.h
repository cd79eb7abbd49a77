/* Light samples with a shadow map each, looked up per pixel and left in scratch textures for a
 * filter (shaders/light_ratio.glsl). */
#pragma once
#include "renderer/passes/penumbra.h"
#include "renderer/passes/sample_maps.h"

#define LIGHT_SAMPLES_MOST 64

/* Adds this face's receivers to SCRATCH_LIT and, under a textured light, SCRATCH_ALL; its first
 * face clears them. `maps` points of the light are used, at most LIGHT_SAMPLES_MOST; all of them by
 * every pixel, or, when `sparse`, P(samples) of them, different ones than its neighbours take. */
bool pass_light_samples(struct technique_run *run, uint32_t maps, uint32_t map_size, bool sparse,
    struct pen_error *error);
