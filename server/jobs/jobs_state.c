#include "server/jobs/jobs_state.h"
#include "protocol/memory.h"
#include <stdlib.h>
#include <string.h>

int64_t jobs_expiry_s(const struct jobs *jobs)
{
    return jobs_now_s() + (int64_t)jobs->config.keep_s;
}

void jobs_wake(struct jobs *j)
{
    pthread_mutex_lock(&j->lock);
    j->woken = true;
    pthread_cond_signal(&j->news);
    pthread_mutex_unlock(&j->lock);
}

struct running *jobs_make_running(struct jobs *j, const struct job *job, struct job_plan *plan)
{
    struct running *running = pen_alloc_zero(1, sizeof *running);
    running->jobs = j;
    running->job = *job;
    running->plan = plan;
    running->frames = pen_alloc_zero(job->frames, 1);
    running->attempts = pen_alloc_zero(job->frames, 1);
    running->is_settled = *job->settings || !job_plan_needs_settings(plan);
    return running;
}

void jobs_free_running(struct running *running)
{
    if (!running)
        return;
    job_plan_destroy(running->plan);
    free(running->frames);
    free(running->attempts);
    free(running);
}

void jobs_tell(struct jobs *j, const uint8_t *id, enum job_news news)
{
    pthread_mutex_lock(&j->watch_lock);
    for (struct job_watch *watch = j->watches; watch; watch = watch->next)
        if (!id || !memcmp(watch->id, id, PEN_ID_BYTES))
            watch->tell(watch, news);
    pthread_mutex_unlock(&j->watch_lock);
}
