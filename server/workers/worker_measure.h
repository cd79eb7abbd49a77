/* Measuring on the worker, where the frames are: a reference's planes go out, and later pictures
 * are compared with them. Runs on the encoder threads. */
#pragma once
#include "server/workers/worker_item.h"

/* What must be rendered to measure: every layer, in float. */
void worker_measure_output(struct pen_output *output);

/* Fills the answer's descriptors as item->measure says, and result.comparison when there is a
 * reference. Errors: PEN_INTERNAL, in the item's result. */
bool worker_measure(struct worker_item *item, struct channel_fds *fds);
