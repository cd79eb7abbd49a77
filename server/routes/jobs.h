/* Jobs, for the files that answer for them. */
#pragma once
#include "server/jobs/jobs.h"
#include "server/routes/call.h"

/* The job of the address, which must be the caller's where tokens tell whose is whose; NULL, and the
 * errors of job_store_get. */
struct job_store *routes_find_job(struct call *call, struct job *job, struct pen_error *error);
