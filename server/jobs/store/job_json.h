/* A job as clients see it. */
#pragma once
#include "protocol/json_writer.h"
#include "server/jobs/store/job_store.h"

void job_write(struct pen_json *json, const char *key, const struct job *job);
char *job_json(const struct job *job); /* malloc'd */
