#include "server/jobs/jobs.h"
#include "protocol/memory.h"
#include "protocol/request.h"
#include "server/base/clock.h"
#include "server/jobs/store/job_files.h"
#include "server/jobs/finisher.h"
#include "server/jobs/jobs_state.h"
#include "server/jobs/runner.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <time.h>
#include <unistd.h>

#define MOST_RETRY_S 600

struct jobs *jobs_create(const struct jobs_config *config)
{
    struct jobs *j = pen_alloc_zero(1, sizeof *j);
    pthread_condattr_t monotonic;
    j->config = *config;
    j->root = -1;
    pthread_mutex_init(&j->lock, NULL);
    pthread_mutex_init(&j->watch_lock, NULL);
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_cond_init(&j->news, &monotonic);
    pthread_cond_init(&j->to_finish_news, NULL);
    pthread_condattr_destroy(&monotonic);
    jobs_open_store(j);
    if (pthread_create(&j->runner, NULL, jobs_run, j) ||
        pthread_create(&j->finisher, NULL, jobs_finish, j))
        abort();
    return j;
}

void jobs_drain(struct jobs *j)
{
    if (!j)
        return;
    pthread_mutex_lock(&j->lock);
    __atomic_store_n(&j->draining, true, __ATOMIC_RELEASE);
    j->woken = true;
    pthread_cond_signal(&j->news);
    pthread_cond_signal(&j->to_finish_news);
    pthread_mutex_unlock(&j->lock);
    jobs_tell(j, NULL, JOB_CLOSING);
}

static void free_list(struct running *list)
{
    while (list) {
        struct running *running = list;
        list = running->next;
        jobs_free_running(running);
    }
}

void jobs_destroy(struct jobs *j)
{
    if (!j)
        return;
    jobs_drain(j);
    pthread_join(j->runner, NULL);
    pthread_join(j->finisher, NULL);
    free_list(j->first);
    free_list(j->incoming);
    job_store_close(j->store);
    if (j->root >= 0)
        close(j->root);
    pthread_cond_destroy(&j->news);
    pthread_cond_destroy(&j->to_finish_news);
    pthread_mutex_destroy(&j->watch_lock);
    pthread_mutex_destroy(&j->lock);
    free(j);
}

struct job_store *jobs_store(struct jobs *j, struct pen_error *error)
{
    pthread_mutex_lock(&j->lock);
    struct job_store *store = j->store;
    if (!store)
        pen_fail(error, j->why_none.code, "", "%s", j->why_none.message);
    if (!store && error)
        error->retry_after_s = JOBS_OPEN_S;
    pthread_mutex_unlock(&j->lock);
    return store;
}

bool jobs_read(struct jobs *j, struct job_numbers *numbers)
{
    pthread_mutex_lock(&j->lock);
    *numbers = j->numbers;
    bool there = j->store != NULL;
    pthread_mutex_unlock(&j->lock);
    return there;
}

/* ---- jobs under way ---- */

/* Seconds until the first of those under way is likely to be over. With the lock held. */
static uint32_t retry_s(const struct jobs *j)
{
    double least = MOST_RETRY_S;
    uint32_t count = 0;
    for (const struct running *r = j->first; r; r = r->next)
        count++;
    for (const struct running *r = j->first; r; r = r->next)
        least = fmin(least, (r->job.frames - __atomic_load_n(&r->there, __ATOMIC_RELAXED)) *
                                j->frame_ms * count / 1e3);
    return (uint32_t)fmax(1, ceil(least));
}

/* The time in microseconds, and 192 random bits. */
static void make_id(uint8_t id[PEN_ID_BYTES])
{
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    uint64_t us = (uint64_t)now.tv_sec * 1000000 + (uint64_t)now.tv_nsec / 1000;
    for (int i = 0; i < 8; i++)
        id[i] = (uint8_t)(us >> 8 * (7 - i));
    if (getrandom(id + 8, PEN_ID_BYTES - 8, 0) != PEN_ID_BYTES - 8)
        abort();
}

static bool is_draining(struct jobs *j)
{
    return __atomic_load_n(&j->draining, __ATOMIC_ACQUIRE);
}

bool jobs_submit(struct jobs *j, const struct job_order *order, uint8_t id[PEN_ID_BYTES],
    struct pen_error *error)
{
    struct job_store *store = jobs_store(j, error);
    if (is_draining(j))
        return pen_fail(error, PEN_UNAVAILABLE, "", "The service is shutting down.");
    struct job_plan *plan = store ? job_plan_create(&j->config.makers, order->kind, order->scene,
                                        order->body, order->bytes, error)
                                  : NULL;
    if (!plan)
        return false;
    struct job job = {.kind = order->kind,
        .client = order->client,
        .frames = job_plan_frames(plan),
        .seq = 1,
        .state_seq = 1,
        .created_s = jobs_now_s()};
    make_id(job.id);
    memcpy(job.scene, job_plan_scene(plan), PEN_ID_BYTES);
    uint8_t own[PEN_ID_BYTES];
    memcpy(own, job.id, PEN_ID_BYTES);
    char *body = memcpy(pen_alloc_zero(order->bytes + 1, 1), order->body, order->bytes);
    bool ok = job_store_add(store, &job, body, order->key, &j->config.limits, error);
    free(body);
    memcpy(id, job.id, PEN_ID_BYTES);
    bool is_new = ok && !memcmp(id, own, PEN_ID_BYTES);
    struct running *running = jobs_make_running(j, &job, plan);
    pthread_mutex_lock(&j->lock);
    if (is_new) {
        running->next = j->incoming;
        j->incoming = running;
        running = NULL;
        j->woken = true;
        pthread_cond_signal(&j->news);
    } else if (!ok && error && !error->retry_after_s) {
        error->retry_after_s = retry_s(j);
    }
    pthread_mutex_unlock(&j->lock);
    jobs_free_running(running);
    return ok;
}

/* True when it was under way. */
static bool cancel(struct jobs *j, const uint8_t id[PEN_ID_BYTES])
{
    bool found = false;
    pthread_mutex_lock(&j->lock);
    struct running *lists[] = {j->first, j->incoming};
    for (int l = 0; l < 2; l++)
        for (struct running *r = lists[l]; r; r = r->next)
            if (!memcmp(r->job.id, id, PEN_ID_BYTES)) {
                __atomic_store_n(&r->cancelled, true, __ATOMIC_RELEASE);
                found = true;
            }
    j->woken = true;
    pthread_cond_signal(&j->news);
    pthread_mutex_unlock(&j->lock);
    return found;
}

bool jobs_delete(
    struct jobs *j, const uint8_t id[PEN_ID_BYTES], bool *removed, struct pen_error *error)
{
    struct job_store *store = jobs_store(j, error);
    struct job job;
    struct pen_error fault = {0};
    *removed = false;
    if (!store || !job_store_get(store, id, &job, error))
        return false;
    if (!job_is_over(job.state)) {
        job.state = JOB_DISMISSED;
        job.ended_s = jobs_now_s();
        job.expires_s = jobs_expiry_s(j);
        cancel(j, id);
        bool ended = job_store_set_state(store, &job, &fault);
        jobs_tell(j, id, JOB_CHANGED);
        if (ended)
            return true;
        if (fault.code != PEN_OK)
            return pen_fail(error, fault.code, "", "%s", fault.message);
    }
    *removed = true;
    if (!job_store_remove(store, id, error))
        return false;
    job_files_remove(j->root, id);
    jobs_tell(j, id, JOB_CHANGED);
    return true;
}

int jobs_open_file(struct jobs *j, const uint8_t id[PEN_ID_BYTES], const struct job_file *file,
    bool checked, struct pen_error *error)
{
    return jobs_store(j, error) ? job_files_read(j->root, id, file, checked, error) : -1;
}

bool jobs_frame_request(struct jobs *j, const struct job *job, uint32_t frame,
    struct pen_request *request, struct pen_error *error)
{
    struct job_store *store = jobs_store(j, error);
    char *body = store ? job_store_body(store, job->id) : NULL;
    struct job_plan *plan =
        body ? job_plan_create(&j->config.makers, job->kind, job->scene, body, strlen(body), error)
             : NULL;
    free(body);
    bool ok = plan != NULL;
    if (ok && frame >= job_plan_frames(plan))
        ok = pen_fail(error, PEN_NOT_FOUND, "", "This job has %u frames.", job_plan_frames(plan));
    if (ok && frame && job_plan_needs_settings(plan) && !*job->settings) {
        ok = pen_fail(error, PEN_UNAVAILABLE, "",
            "The first frame, whose exposure all have, is "
            "not there yet.");
        error->retry_after_s = 1;
    }
    if (ok)
        job_plan_request(plan, frame, job->settings, request);
    else
        pen_fail(error, PEN_NOT_FOUND, "", "There is no such job, or it has expired.");
    job_plan_destroy(plan);
    return ok;
}

/* ---- watching ---- */

void jobs_watch(struct jobs *j, struct job_watch *watch)
{
    pthread_mutex_lock(&j->watch_lock);
    watch->next = j->watches;
    j->watches = watch;
    pthread_mutex_unlock(&j->watch_lock);
    if (is_draining(j)) /* it came when all others had been told */
        jobs_tell(j, watch->id, JOB_CLOSING);
}

void jobs_unwatch(struct jobs *j, struct job_watch *watch)
{
    pthread_mutex_lock(&j->watch_lock);
    for (struct job_watch **at = &j->watches; *at; at = &(*at)->next)
        if (*at == watch) {
            *at = watch->next;
            break;
        }
    pthread_mutex_unlock(&j->watch_lock);
}
