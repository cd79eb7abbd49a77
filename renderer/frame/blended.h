/* Pictures of scenes with blended surfaces: of what is solid, and in front of it up to
 * BLENDED_LAYERS layers, peeled off from the nearest on (Everitt 2001), each with its own light and
 * shadow. The last of them stands for all that lie behind it, by a share alpha of its pixels: right
 * in the mean. Data layers are of one such share of everything. */
#pragma once
#include "renderer/frame/job.h"
#include "renderer/passes/draw/gbuffer.h"

#define BLENDED_LAYERS 8

/* What data layers are about. */
const struct gbuffer *frame_data_gbuffer(const struct frame_job *job);

void frame_blended_fit(const struct frame_job *job);
/* Starts a jittered frame: targets->layers takes all layers, nearest first. */
void frame_blended_begin(const struct frame_job *job);
/* How to draw layer `number`; and after it is shaded. */
struct gbuffer_pass frame_blended_pass(const struct frame_job *job, uint32_t number);
void frame_blended_next(const struct frame_job *job, uint32_t number);
/* What came before stays as it is while an estimate of what is solid is shown. */
void frame_blended_keep(const struct frame_job *job);
void frame_blended_restore(const struct frame_job *job);
/* Adds the sum to the picture's. */
bool frame_blended_end(const struct frame_job *job, struct pen_error *error);
