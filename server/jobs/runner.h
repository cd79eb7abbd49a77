/* The thread that gives frames to the queue, writes what comes back, and ends jobs. */
#pragma once
#include "server/jobs/jobs_state.h"

/* Opens the database, unless that was tried a moment ago, and takes up what is in it. */
void jobs_open_store(struct jobs *jobs);
void *jobs_run(void *jobs);
