/* What one frame in progress has for itself: targets, what passes and methods keep, its timers and
 * its stack. As many frames can be in progress side by side as there are lanes. */
#pragma once
#include "renderer/frame/frame.h"

struct lane {
    struct technique_ctx ctx; /* partly its own, partly shared with the other lanes */
    struct frame_targets targets;
    void **states; /* of the methods; NULL: not made yet */
    struct gl_fiber *fiber;
    struct frame_job job;
    /* Of the frame in progress: */
    bool busy, ended, ok;
    struct gl_account *charged; /* where it stopped */
    uint64_t programs_since;    /* gl_programs_clock when it began */
    struct pen_frame *frame;
    struct pen_result *result;
    struct pen_error error;
};

/* `shared` has what lanes share; nothing is made on the device before the first call. */
bool lane_make(struct lane *lane, const struct technique_ctx *shared, uint32_t number,
    struct pen_error *error);
void lane_finish(struct lane *lane); /* not busy; zeroed or not made is fine */

/* Begins lane->job, which is charged to *account; what is pointed at stays until the end. */
void lane_begin(struct lane *lane, struct gl_account *account, struct pen_frame *frame,
    struct pen_result *result);
/* Goes on with it for about so many ms. True when it has ended. */
bool lane_advance(struct lane *lane, double ms);
/* Of one that has not ended: it gives up at once. */
void lane_cancel(struct lane *lane);
