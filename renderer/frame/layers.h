/* Layers about the work rather than the light: what the classifier proved of a pixel, and how far
 * off its visibility may be; and how many pixels there were to work on. */
#pragma once
#include "renderer/frame/job.h"

bool frame_layers_want_classes(const struct pen_request *request);
/* Only for methods that estimate their error. */
bool frame_layers_want_error(const struct pen_request *request, const struct technique *technique);

/* Makes what the request wants fit, and clears it. Warns of an error layer that will be 0. */
void frame_layers_begin(const struct frame_job *job, struct pen_result *result);

/* Adds the mean over the lights of what is in targets->vis. */
bool frame_layers_add_visibility(
    const struct frame_job *job, uint32_t light_count, struct pen_error *error);
/* Adds one face of one light of one jittered frame. `tiles`: of pass_classify, or NULL when the
 * method worked on every pixel. `first`: of the light's faces; the background counts with it. */
bool frame_layers_add_classes(const struct frame_job *job, const struct gl_texture *tiles,
    bool first, struct pen_error *error);

/* Pixels that show a surface, for the lights whose method worked on all of them. */
struct frame_work {
    GLuint queries[PEN_MAX_ANTIALIAS];  /* of each jittered frame */
    uint32_t lights[PEN_MAX_ANTIALIAS]; /* of it, whose method counted nothing itself */
};
/* Starts counting the receivers in the G-buffer of jittered frame `number`. */
bool frame_layers_count_receivers(
    const struct frame_job *job, uint32_t number, struct frame_work *work, struct pen_error *error);
/* Those in a G-buffer, at once. */
bool frame_layers_count_now(const struct frame_job *job, const struct gbuffer *gbuffer,
    uint32_t *receivers, struct pen_error *error);

/* After the last frame: adds to result->full_work_pixels, and warns of a layer of classes for which
 * nothing was classified. */
void frame_layers_end(const struct frame_job *job, const struct frame_work *work, bool classified,
    struct pen_result *result);
