#include "server/jobs/finisher.h"
#include "server/base/clock.h"
#include "server/jobs/archive.h"
#include "server/jobs/store/job_files.h"
#include <unistd.h>

#define TRIES 3
#define PAUSE_US 500000

static bool is_wanted(void *context)
{
    const struct running *r = context;
    return !__atomic_load_n(&r->cancelled, __ATOMIC_ACQUIRE) &&
           !__atomic_load_n(&r->jobs->draining, __ATOMIC_ACQUIRE);
}

static bool make(struct jobs *j, struct running *r, struct pen_error *error)
{
    int folder = job_files_open(j->root, r->job.id, error);
    struct archive_job job = {.folder = folder,
        .plan = r->plan,
        .frames = r->job.frames,
        .time_s = r->job.created_s,
        .is_wanted = is_wanted,
        .context = r};
    if (folder < 0)
        return false;
    job_files_tidy(folder);
    bool ok = archive_write(&job, r->job.result.name, error) &&
              job_files_keep(folder, &r->job.result, error);
    if (!ok) {
        r->job.result = (struct job_file){0};
        job_files_tidy(folder);
    }
    close(folder);
    return ok;
}

static void finish(struct jobs *j, struct running *r)
{
    struct pen_error error = {0};
    bool fits = 2 * r->job.bytes <= j->config.limits.bytes; /* as large as its frames, again */
    if (!fits)
        pen_fail(&error, PEN_UNAVAILABLE, "", "There is no room for more results of jobs.");
    for (int i = 0; fits && i < TRIES; i++) {
        error = (struct pen_error){0};
        bool may_pass =
            !make(j, r, &error) && (error.code == PEN_UNAVAILABLE || error.code == PEN_FULL);
        if (!may_pass || !is_wanted(r))
            break;
        usleep(PAUSE_US);
    }
    if (error.code != PEN_OK && is_wanted(r)) {
        r->has_failed = true;
        r->job.error = error;
    }
    r->is_finished = error.code == PEN_OK;
    __atomic_store_n(&r->is_with_finisher, false, __ATOMIC_RELEASE);
    jobs_wake(j);
}

void *jobs_finish(void *context)
{
    struct jobs *j = context;
    pthread_mutex_lock(&j->lock);
    while (!j->draining) {
        struct running *r = j->to_finish;
        if (!r) {
            pthread_cond_wait(&j->to_finish_news, &j->lock);
            continue;
        }
        pthread_mutex_unlock(&j->lock);
        finish(j, r);
        pthread_mutex_lock(&j->lock);
        j->to_finish = NULL;
    }
    pthread_mutex_unlock(&j->lock);
    return NULL;
}
