/* Smooth edges at the price of a depth pass: of a picture with one shaded sample per pixel. */
#pragma once
#include "renderer/frame/job.h"

/* Of the beauty layer; all others say what is at the centre of a pixel. */
bool frame_edges_are_smooth(const struct frame_job *job);
/* By OpenGL. Where that runs on the CPU it costs less to make them smooth in what has been read, of
 * those pixels alone that show any. */
bool frame_edges_are_drawn(const struct frame_job *job);
/* What the file holds of the beauty layer, into targets->color. `resolved`:
 * targets->stairs is the picture, else the sum in targets->beauty; `raw`: the file is of radiance. */
bool frame_edges_blend(const struct frame_job *job, const struct view *view, bool resolved,
    bool raw, struct pen_error *error);
/* What there is to know of the picture's edges is found once and kept, for those that are shown of the same
 * frame, until it is dropped. Nothing where it would be too much, or OpenGL draws them. */
void frame_edges_keep(const struct frame_job *job);
void frame_edges_drop(struct frame_targets *targets);
/* In the beauty layer as the file holds it. */
bool frame_edges_smooth(const struct frame_job *job, const struct view *view, bool raw,
    struct pen_plane *plane, struct pen_error *error);
