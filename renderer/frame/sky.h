/* The studio around a scene: what it adds to shading, and how much of it surfaces see. */
#pragma once
#include "renderer/frame/job.h"

struct shade_block;

/* Fills in the block's sky, of a completed request; all zero when it wants none. */
void sky_choose(
    struct shade_block *block, const struct pen_request *request, const struct view *view);

/* Draws how much of the sky each pixel's surface sees into targets->sky_open[1], R8, half the
 * picture's size. `solid`: depth of what stands around the surfaces of the G-buffer besides them, or
 * NULL. */
bool sky_occlusion(const struct frame_job *job, const struct gbuffer *gbuffer,
    const struct gl_texture *solid, struct pen_error *error);
