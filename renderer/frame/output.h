/* The last step of a frame: layers into the pixel type of the file, and out of the GPU. */
#pragma once
#include "renderer/frame/job.h"
#include "renderer/picture.h"

/* True when one 8-bit beauty image of one frame is all that is wanted: shading then resolves. */
bool frame_output_is_direct(const struct frame_job *job);

/* About what all targets of a picture will take, bytes, with what methods commonly add. `blended`: of
 * a scene with blended surfaces. */
uint64_t frame_output_estimate(const struct pen_request *request, uint32_t lights, bool blended);

/* Sees to the memory of that, piece by piece; false as pass_turn. */
bool frame_output_room(const struct frame_job *job, uint32_t lights, struct pen_error *error);

/* Tells all passes of jittered frame `number` what it shows, and how it is displayed. */
void frame_output_aim(const struct frame_job *job, const struct view *view, uint32_t number);

/* Makes targets->color (and its framebuffer) fit the output. */
void frame_output_fit(struct frame_targets *targets, const struct pen_request *request);
/* `frames`: how many jittered ones are in it. */
bool frame_output_read(const struct frame_job *job, const struct view *view, uint32_t frames,
    struct pen_frame *frame, struct pen_error *error);
