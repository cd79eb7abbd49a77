/* Which tiles of the image are certainly lit, certainly in umbra, or undecided, from the min-max
 * pyramid of the casters. Conservative for methods that compare depths of that map inside the
 * windows F3 and F4: skipping decided tiles changes no pixel. */
#pragma once
#include "renderer/passes/draw/tiles.h"
#include "renderer/passes/map/bound.h"
#include "renderer/technique.h"

/* What a method needs to be true of a decided tile. */
struct classify_desc {
    uint32_t map_size;   /* of the casters' depth map, texels per side */
    float margin_texels; /* how far beyond the filter windows the method may look */
    float margin_pixels; /* added to it, in pixels of the image, head-on */
    /* Looks for umbra too. Not for methods that look from other points of the emitter, which may
     * see between casters that hide each other from its centre, nor for those that filter depths:
     * what they leave of the light behind casters is no certain 0. */
    bool umbra;
    /* The method sizes one window by the nearest caster of all, and may take into it what lies too
     * near the receiver to reach that far; or it filters depths, where only a window with nothing
     * nearer than the receivers answers 1. */
    bool one_window;
    bool seams;     /* It filters on the screen, over the seams of a cube's faces: all undecided. */
    uint32_t bound; /* enum bound_window, of methods that average depths */
};

/* Classifies run's face and writes 0 to the umbra tiles of vis. Adds the receivers to
 * run->result->class_pixels, and the undecided ones to full_work_pixels. Of a cube's faces, each
 * classifies the tiles that it owns wholly, leaves those that it owns in part undecided, and calls
 * the others empty. *tiles is for pass_screen, valid until the next call and also in run->tiles;
 * NULL when the request wants every pixel. */
bool pass_classify(struct technique_run *run, const struct classify_desc *desc,
    const struct gl_texture **tiles, struct pen_error *error);

/* Writes 0 to the umbra tiles of another target, such as a method's scratch. */
bool pass_fill_umbra(struct technique_run *run, const struct gl_texture *tiles, GLuint framebuffer,
    struct pen_error *error);
