/* Which 8 x 8 tiles of the image are certainly lit, certainly in umbra, or undecided, from the
 * min-max pyramid of the casters. Conservative for methods that compare depths of that map inside
 * the windows F3 and F4: skipping decided tiles changes no pixel. */
#pragma once
#include "renderer/passes/draw/passes.h"

#define CLASSIFY_TILE 8 /* px */

/* enum tile_class */
#define SHARED_ROWS "renderer/shaders/screen/tile_class.def"
#include "renderer/shared/rows_c.h"

/* Classifies run's face and writes 0 to the umbra tiles of vis. `margin_texels`: how far beyond the
 * filter windows the method may look. Adds the receivers to run->result->class_pixels, and the
 * undecided ones to full_work_pixels. Of a cube's faces, each classifies the tiles that it owns
 * wholly, leaves those that it owns in part undecided, and calls the others empty. The answer is
 * valid until the next call and also in run->tiles; pass it to pass_screen as `tiles`. */
const struct gl_texture *pass_classify(struct technique_run *run,
    const struct shadow_input *casters, float margin_texels, struct pen_error *error);

/* The same for methods that filter on the screen: over the seams of a cube's faces, which all stay
 * undecided. They also size one window by the nearest caster of all, and may take into it what lies
 * too near the receiver to reach that far. */
const struct gl_texture *pass_classify_screen(struct technique_run *run,
    const struct shadow_input *casters, float margin_texels, struct pen_error *error);

/* The same as pass_classify without umbra: for methods that look from other points of the emitter,
 * which may see between casters that hide each other from its centre. */
const struct gl_texture *pass_classify_lit(struct technique_run *run,
    const struct shadow_input *casters, float margin_texels, struct pen_error *error);

/* The same for methods that filter depths, not comparisons. What they leave of the light behind
 * casters is no certain 0; but where nothing in the window is nearer than the receivers, its mean
 * is not either, and all of them answer 1. `margin_pixels`: what is added to margin_texels, in
 * pixels of the image, head-on. *tiles is NULL when the request wants every pixel. */
bool pass_lit_tiles(struct technique_run *run, uint32_t map_size, float margin_texels,
    float margin_pixels, const struct gl_texture **tiles, struct pen_error *error);

/* Writes 0 to the umbra tiles of another target, such as a method's scratch. */
bool pass_fill_umbra(struct technique_run *run, const struct gl_texture *tiles, GLuint framebuffer,
    struct pen_error *error);
