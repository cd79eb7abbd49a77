/* Takes up what was under way when the daemon ended. */
#pragma once
#include "server/jobs/jobs_state.h"

/* Fills the list of jobs under way from the store, which nobody else uses yet. */
void jobs_recover(struct jobs *jobs, struct job_store *store);
