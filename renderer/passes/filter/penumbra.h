/* Penumbrae on the screen: their size per pixel, and filters as wide as they are. For methods that
 * fill the visibility of all faces of a light at once, with the last one. */
#pragma once
#include "renderer/passes/draw/screen.h"

/* What the passes of one light hand to each other: screen-sized, until the next light's. */
enum penumbra_target {
    PENUMBRA_SPREAD,
    PENUMBRA_LIT,
    PENUMBRA_ALL, /* what a filter reads; ALL only of textured lights */
    PENUMBRA_LIT_NEXT,
    PENUMBRA_ALL_NEXT, /* and writes */
    PENUMBRA_TARGETS
};
const struct gl_target *pass_penumbra_target(struct technique_run *run, enum penumbra_target which);

/* Writes PENUMBRA_SPREAD, RGBA16F, for this face's receivers: hard visibility, then the Gaussian of
 * screen_spread in penumbra.glsl, px. (1, 0, 0, 0): proved to be lit, or no receiver at all; all
 * zeros: a receiver that all of the light is behind. */
bool pass_penumbra_spread(
    struct technique_run *run, uint32_t map_size, float min_filter, struct pen_error *error);

/* pass_classify for such methods. Umbra tiles of `spread` become (0, 0, 0, 0.001): dark, and nothing
 * to filter. */
bool pass_penumbra_tiles(struct technique_run *run, uint32_t map_size, float margin_texels,
    const struct gl_target *spread, const struct gl_texture **tiles, struct pen_error *error);

enum penumbra_source { PENUMBRA_HARD, PENUMBRA_SAMPLES };

/* Fills vis from PENUMBRA_SPREAD's hard visibility, or from the sums of PENUMBRA_LIT
 * (PENUMBRA_ALL), by a separable Gaussian of P(sigma) times the light's own. Nothing happens
 * before the last face. */
bool pass_penumbra_gauss(
    struct technique_run *run, enum penumbra_source source, struct pen_error *error);

/* Makes PENUMBRA_LIT (PENUMBRA_ALL), or their successors, fit this light and start as lit pixels. */
void pass_penumbra_start(struct technique_run *run, bool next);

/* As pass_penumbra_gauss, by `levels` of an a-trous transform; levels 0: unfiltered. */
bool pass_penumbra_atrous(struct technique_run *run, uint32_t levels, struct pen_error *error);
