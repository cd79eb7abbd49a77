/* What comes back from a job that measures; see enum measure. */
#pragma once
#include "server/workers/channel.h"
#include "server/queue/scheduler.h"

/* Makes the outcome's pictures, named by the hash of their own bytes (they answer no render
 * request), and its planes, from the answer's descriptors and outcome->result. Errors:
 * PEN_INTERNAL, in the outcome, when the worker handed over something else. */
void measured_take(uint32_t measure, const struct channel_fds *fds, struct outcome *outcome);
/* Releases the outcome's pictures, of whatever job. */
void measured_release(struct outcome *outcome);
