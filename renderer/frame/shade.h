/* Shading, and the studio around a scene: what it adds to it, and how much of that surfaces see. */
#pragma once
#include "renderer/frame/job.h"

/* Draws how much of the sky each pixel's surface sees into targets->sky_open[1], half the picture's
 * size. `solid`: depth of what stands around the surfaces of the G-buffer besides them, or
 * NULL. */
bool sky_occlusion(const struct frame_job *job, const struct gbuffer *gbuffer,
    const struct gl_texture *solid, struct pen_error *error);

struct shading {
    const struct view *view;
    const struct gbuffer *gbuffer; /* what is lit */
    const struct light *lights;
    uint32_t light_count;
    bool layer;                     /* it is a blended one */
    const struct gl_texture *tiles; /* NULL: all pixels; else those of tiles that are undecided */
};
/* Light times its visibility (targets->vis), sky and emission, where the picture comes together. */
bool frame_shade(
    const struct frame_job *job, const struct shading *shading, struct pen_error *error);
