/* What comes back is kept: a file first, then a row. For the runner. */
#pragma once
#include "server/jobs/jobs_state.h"

/* Errors of both: those of job_files.h and job_store.h. */
bool jobs_keep_frame(struct jobs *jobs, struct running *running, uint32_t number,
    const struct picture *picture, struct pen_error *error);
/* The images that are not there yet, and the document, which is the job's result. */
bool jobs_keep_comparison(
    struct jobs *jobs, struct running *running, struct compare *compare, struct pen_error *error);
