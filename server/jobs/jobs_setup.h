/* What jobs are given, and how they tell of themselves. */
#pragma once
#include "server/jobs/job_plan.h"
#include "server/queue/scheduler.h"
#include "server/store/result_cache.h"
#include <time.h>

struct jobs_config {
    const char *store; /* the store's folder */
    struct scheduler *scheduler;
    struct result_cache *cache;
    struct job_plan_makers makers;
    struct job_limits limits;
    uint32_t workers;
    uint32_t in_flight; /* frames in the queue at a time, of all jobs */
    uint64_t keep_s;    /* results of a job that is over, and keys */
    /* The device, once a worker has told; may be NULL: pictures in the cache are not used. */
    bool (*read_device)(void *context, struct pen_device_info *device);
    void *context;
};

/* Somebody who is told when a job changes. */
enum job_news { JOB_CHANGED, JOB_BEAT, JOB_CLOSING }; /* BEAT: now and then, without news */
struct job_watch {
    struct job_watch *next;
    uint8_t id[PEN_ID_BYTES];
    /* Any thread; must not call jobs. */
    void (*tell)(struct job_watch *watch, enum job_news news);
};

/* Now, in seconds since 1970. */
static inline int64_t jobs_now_s(void)
{
    return time(NULL);
}
