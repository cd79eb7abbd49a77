/* The thread that makes what all frames of a sequence together are. */
#pragma once
#include "server/jobs/jobs_state.h"

void *jobs_finish(void *jobs);
