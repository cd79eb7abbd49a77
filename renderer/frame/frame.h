/* One image: the list of passes from geometry to finished pixels. */
#pragma once
#include "renderer/frame/job.h"
#include "renderer/picture.h"

/* Fills *frame (planes allocated) and the counters of *result. */
bool frame_render(const struct frame_job *job, struct pen_frame *frame, struct pen_result *result,
    struct pen_error *error);
