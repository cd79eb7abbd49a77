/* All frames of a sequence in one file. */
#pragma once
#include "server/jobs/job_plan.h"

/* Animated pictures are put together in memory. */
#define ARCHIVE_MOST_WEBP_BYTES (256ull << 20)

struct archive_job {
    int folder; /* with the frames */
    const struct job_plan *plan;
    uint32_t frames;
    int64_t time_s;                   /* that the files in a zip are of */
    bool (*is_wanted)(void *context); /* asked now and then; false ends it */
    void *context;
};
/* Writes JOB_FILES_TEMPORARY, and says what it should be called. Errors: PEN_UNAVAILABLE and PEN_FULL
 * (it cannot be written, or is not wanted any more), PEN_TOO_BIG (ARCHIVE_MOST_WEBP_BYTES), PEN_INTERNAL (a frame is damaged). */
bool archive_write(
    const struct archive_job *job, char name[JOB_NAME_BYTES], struct pen_error *error);
