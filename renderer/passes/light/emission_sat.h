/* Sums of a light's emission over rectangles of the emitter (Crow 1984). */
#pragma once
#include "renderer/passes/map/shadow_cache.h"

#define EMISSION_SAT_CELLS 128

/* textures[0]: RGBA32F, (cells + 1)^2 corner sums: texel (x, y) is the integral of emission over
 * the emitter's part left of and below that corner, divided by the emitter's area. For
 * emission_sat.glsl, with GL_SAMPLE_LINEAR. Kept between requests. */
const struct shadow_input *pass_emission_sat(struct technique_run *run, struct pen_error *error);
