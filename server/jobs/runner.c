#include "server/jobs/runner.h"
#include "protocol/container.h"
#include "protocol/memory.h"
#include "server/base/clock.h"
#include "server/base/log.h"
#include "server/jobs/keep.h"
#include "server/jobs/store/job_files.h"
#include "server/jobs/recovery.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MOST_ATTEMPTS 4 /* at one frame */
#define MOST_WRITES 6   /* of one file; the disk may have room again */
#define BACKOFF_NS (500 * CLOCK_MS)
#define IDLE_NS (5 * CLOCK_S)
#define EXPIRY_NS (5 * CLOCK_S)
#define BEAT_NS (15 * CLOCK_S) /* proxies close what is silent for longer */
#define RECORD_NS (2 * CLOCK_S)
#define PATIENCE_NS (365ull * 24 * 3600 * CLOCK_S)

static bool is_draining(const struct jobs *j)
{
    return __atomic_load_n(&j->draining, __ATOMIC_ACQUIRE);
}

static bool is_cancelled(const struct running *r)
{
    return __atomic_load_n(&r->cancelled, __ATOMIC_ACQUIRE);
}

/* ---- the queue's side ---- */

static struct flight *flight_of(struct waiter *waiter)
{
    return container_of(waiter, struct flight, waiter);
}

/* Any thread. */
static bool is_gone(struct waiter *waiter)
{
    const struct running *r = flight_of(waiter)->job;
    return is_cancelled(r) || __atomic_load_n(&r->has_failed, __ATOMIC_ACQUIRE) ||
           is_draining(r->jobs);
}

static void land(struct flight *flight)
{
    struct jobs *j = flight->job->jobs;
    pthread_mutex_lock(&j->lock);
    flight->next = j->ended;
    j->ended = flight;
    pthread_cond_signal(&j->news);
    pthread_mutex_unlock(&j->lock);
}

/* Any thread. */
static void finish(struct waiter *waiter, const struct outcome *outcome)
{
    struct flight *flight = flight_of(waiter);
    flight->error = outcome->error;
    if (outcome->error.code == PEN_OK)
        flight->picture = picture_reference(outcome->picture);
    land(flight);
}

/* Of comparisons, any thread. */
static bool is_compare_gone(void *owner)
{
    return is_gone(&((struct flight *)owner)->waiter);
}

/* Before all requests but the first: the image of the one before is there. */
static bool compare_goes_on(void *owner, struct compare *compare, uint32_t request)
{
    const struct flight *flight = owner;
    const struct compare_row *row = &compare_rows(compare)[request - 1];
    if (row->image) {
        struct flight *part = pen_alloc_zero(1, sizeof *part);
        part->job = flight->job;
        part->frame = request - 1;
        part->is_part = true;
        part->picture = picture_reference(row->image);
        land(part);
    }
    return true;
}

static void compare_done(void *owner, struct compare *compare, const struct pen_error *error)
{
    struct flight *flight = owner;
    flight->error = *error;
    flight->compare = compare;
    land(flight);
}

/* ---- ends of jobs ---- */

static void fail_job(struct running *r, uint32_t frame, const struct pen_error *error)
{
    if (r->has_failed)
        return;
    r->job.error = *error;
    __atomic_store_n(&r->has_failed, true, __ATOMIC_RELEASE);
    if (r->job.kind == JOB_SEQUENCE)
        snprintf(r->job.error.message, sizeof r->job.error.message, "Frame %u: %.480s", frame,
            error->message);
}

static void unlink_running(struct jobs *j, struct running *r)
{
    pthread_mutex_lock(&j->lock);
    struct running **at = &j->first;
    while (*at != r)
        at = &(*at)->next;
    *at = r->next;
    pthread_mutex_unlock(&j->lock);
    jobs_free_running(r);
}

/* Records the end. False: it could not be, and is tried again. */
static bool record_end(struct jobs *j, struct running *r, enum job_state state)
{
    struct pen_error error = {0};
    struct job job = r->job;
    job.state = state;
    job.ended_s = jobs_now_s();
    job.expires_s = jobs_expiry_s(j);
    if (!job_store_set_state(j->store, &job, &error) && error.code != PEN_OK)
        return false;
    if (state == JOB_FAILED) {
        char id[PEN_ID_HEX + 1];
        pen_id_to_hex(job.id, id);
        log_event(LOG_ERROR, "job %s failed: %s", id, job.error.message);
    }
    j->bytes += job.result.bytes;
    jobs_tell(j, job.id, JOB_CHANGED);
    return true;
}

static bool has_archive(const struct running *r)
{
    const struct pen_sequence *sequence = job_plan_sequence(r->plan);
    return sequence && sequence->options.archive != PEN_ARCHIVE_NONE;
}

static void give_to_finisher(struct jobs *j, struct running *r)
{
    r->is_with_finisher = true;
    pthread_mutex_lock(&j->lock);
    j->to_finish = r; /* the next one waits until this one is taken */
    pthread_cond_signal(&j->to_finish_news);
    pthread_mutex_unlock(&j->lock);
}

/* All that was asked for is there, but for the archive. */
static bool is_complete(const struct running *r)
{
    return r->there == r->job.frames && (r->job.kind != JOB_COMPARE || *r->job.result.name);
}

/* Ends what can end. */
static void end_jobs(struct jobs *j)
{
    struct running *next;
    for (struct running *r = j->first; r; r = next) {
        next = r->next;
        bool with_finisher = __atomic_load_n(&r->is_with_finisher, __ATOMIC_ACQUIRE);
        if (r->in_flight || with_finisher)
            continue;
        if (is_cancelled(r)) { /* as is recorded */
            unlink_running(j, r);
            continue;
        }
        if (!r->has_failed && !is_complete(r))
            continue;
        if (!r->has_failed && has_archive(r) && !r->is_finished) {
            pthread_mutex_lock(&j->lock);
            bool free = !j->to_finish && !j->draining;
            pthread_mutex_unlock(&j->lock);
            if (free)
                give_to_finisher(j, r);
            continue;
        }
        if (clock_now_ns() < j->record_due_ns)
            continue;
        if (record_end(j, r, r->has_failed ? JOB_FAILED : JOB_SUCCESSFUL))
            unlink_running(j, r);
        else
            j->record_due_ns = clock_now_ns() + RECORD_NS;
    }
}

/* ---- what comes back ---- */

static void free_flight(struct jobs *j, struct flight *flight)
{
    flight->job->in_flight--;
    j->in_flight--;
    picture_release(flight->picture);
    compare_destroy(flight->compare);
    free(flight);
}

/* A frame goes back to be done, or was tried too often. */
static void try_again(struct flight *flight)
{
    struct running *r = flight->job;
    uint32_t frame = flight->frame;
    bool hopeless = pen_code_blame(flight->error.code) == PEN_BLAME_CALLER;
    if (hopeless || ++r->attempts[frame] >= MOST_ATTEMPTS)
        fail_job(r, frame, &flight->error);
    r->due_ns = clock_now_ns() + (BACKOFF_NS << r->attempts[frame]);
}

static void note_pace(struct jobs *j)
{
    uint64_t now = clock_now_ns();
    double ms = clock_ms(now - j->last_frame_ns);
    pthread_mutex_lock(&j->lock); /* for those who ask when one will be over */
    if (j->last_frame_ns && j->in_flight > 1)
        j->frame_ms += (j->frame_ms > 0 ? 0.1 : 1) * (ms - j->frame_ms);
    pthread_mutex_unlock(&j->lock);
    j->last_frame_ns = now;
}

/* False: to be tried again, later. */
static bool settle(struct jobs *j, struct flight *flight)
{
    struct running *r = flight->job;
    struct pen_error error = {0};
    bool is_there = flight->picture || (flight->compare && flight->error.code == PEN_OK);
    if (r->frames[flight->frame] == FRAME_IN_FLIGHT)
        r->frames[flight->frame] = FRAME_TODO;
    if (flight->frame < r->first)
        r->first = flight->frame;
    if (is_cancelled(r) || r->has_failed)
        return true;
    if (!is_there) {
        if (!is_draining(j))
            try_again(flight);
        return true;
    }
    uint64_t bytes = flight->picture ? flight->picture->size : 0;
    if (j->bytes + bytes > j->config.limits.bytes) {
        pen_fail(&error, PEN_UNAVAILABLE, "", "There is no room for more results of jobs.");
        fail_job(r, flight->frame, &error);
        return true;
    }
    if (flight->picture ? jobs_keep_frame(j, r, flight->frame, flight->picture, &error)
                        : jobs_keep_comparison(j, r, flight->compare, &error)) {
        note_pace(j);
        jobs_tell(j, r->job.id, JOB_CHANGED);
        return true;
    }
    if (++flight->writes >= MOST_WRITES || is_draining(j)) {
        if (!is_draining(j))
            fail_job(r, flight->frame, &error);
        return true;
    }
    r->frames[flight->frame] = FRAME_IN_FLIGHT;
    flight->due_ns = clock_now_ns() + (BACKOFF_NS << flight->writes);
    return false;
}

/* One image of a comparison under way; what cannot be kept now is when all of it is there. */
static void take_part(struct jobs *j, struct flight *part)
{
    struct running *r = part->job;
    bool is_wanted = !is_cancelled(r) && !r->has_failed && r->frames[part->frame] != FRAME_DONE;
    if (is_wanted && jobs_keep_frame(j, r, part->frame, part->picture, NULL))
        jobs_tell(j, r->job.id, JOB_CHANGED);
    picture_release(part->picture);
    free(part);
}

static void settle_list(struct jobs *j, struct flight *list)
{
    while (list) {
        struct flight *flight = list;
        list = flight->next;
        if (flight->is_part)
            take_part(j, flight);
        else if (flight->due_ns > clock_now_ns() && !is_draining(j) ? true : !settle(j, flight)) {
            flight->next = j->delayed;
            j->delayed = flight;
        } else {
            free_flight(j, flight);
        }
    }
}

/* ---- what goes out ---- */

static bool compare_out(struct jobs *j, struct flight *flight, struct pen_error *error)
{
    const struct pen_compare *asked = job_plan_compare(flight->job->plan);
    struct compare_plan plan = {.requests = asked->requests,
        .count = 1 + asked->count,
        .payer = flight->job->job.client,
        .patience_ms = 3600000,
        .background = true,
        .wants = compare_goes_on,
        .is_gone = is_compare_gone,
        .done = compare_done,
        .owner = flight};
    return compare_start(j->config.scheduler, &plan, error);
}

/* A picture that is there already need not be rendered. */
static struct picture *recall(struct jobs *j, const struct pen_request *request)
{
    char tag[PEN_ID_HEX + 1];
    struct pen_device_info device;
    if (pen_delivery_is_limited(&request->delivery) || !j->config.read_device ||
        !j->config.read_device(j->config.context, &device))
        return NULL;
    picture_tag(request, &device, tag);
    return result_cache_get(j->config.cache, tag);
}

static bool frame_out(struct jobs *j, struct flight *flight, struct pen_error *error)
{
    struct running *r = flight->job;
    struct pen_request request;
    uint8_t key[PEN_ID_BYTES];
    job_plan_request(r->plan, flight->frame, r->job.settings, &request);
    flight->picture = recall(j, &request);
    if (flight->picture) {
        land(flight);
        return true;
    }
    picture_key(&request, key);
    flight->waiter = (struct waiter){.payer = r->job.client,
        .deadline_ns = clock_now_ns() + PATIENCE_NS,
        .background = true,
        .is_gone = is_gone,
        .finish = finish};
    return scheduler_submit(j->config.scheduler, &request, key,
        !pen_delivery_is_limited(&request.delivery), &flight->waiter, error);
}

/* The first frame that is to be done and may be begun; job.frames: none. */
static uint32_t next_frame(struct running *r)
{
    if (r->has_failed || is_cancelled(r) || is_complete(r) || (!r->is_settled && r->in_flight))
        return r->job.frames;
    if (r->job.kind == JOB_COMPARE) /* in one piece */
        return r->in_flight ? r->job.frames : 0;
    while (r->first < r->job.frames && r->frames[r->first] == FRAME_DONE)
        r->first++;
    for (uint32_t i = r->first; i < r->job.frames; i++)
        if (r->frames[i] == FRAME_TODO)
            return i;
    return r->job.frames;
}

/* The number of the frame that any job of the client's began last, and how many it has out. */
static uint64_t last_served(const struct jobs *j, uint64_t client, uint32_t *in_flight)
{
    uint64_t last = 0;
    *in_flight = 0;
    for (const struct running *r = j->first; r; r = r->next)
        if (r->job.client == client) {
            last = r->served > last ? r->served : last;
            *in_flight += r->in_flight;
        }
    return last;
}

/* The next one of the client who had one longest ago, of its oldest job that has any. The queue does
 * the rest: it counts what they cost. */
static struct running *choose(struct jobs *j)
{
    struct running *best = NULL;
    uint64_t best_last = UINT64_MAX, now = clock_now_ns();
    for (struct running *r = j->first; r; r = r->next) {
        uint32_t in_flight;
        uint64_t last = last_served(j, r->job.client, &in_flight);
        if (r->due_ns > now || in_flight > j->config.workers || last >= best_last ||
            next_frame(r) == r->job.frames)
            continue;
        best = r;
        best_last = last;
    }
    return best;
}

/* Records that a job has begun; whether that succeeds matters little. */
static void note_begin(struct jobs *j, struct running *r)
{
    if (r->job.state != JOB_ACCEPTED)
        return;
    r->job.state = JOB_RUNNING;
    job_store_set_state(j->store, &r->job, NULL);
    jobs_tell(j, r->job.id, JOB_CHANGED);
}

static void send_out(struct jobs *j)
{
    struct running *r;
    while (!is_draining(j) && j->in_flight < j->config.in_flight && (r = choose(j))) {
        struct pen_error error = {0};
        struct flight *flight = pen_alloc_zero(1, sizeof *flight);
        note_begin(j, r);
        flight->job = r;
        flight->frame = next_frame(r);
        if (r->job.kind != JOB_COMPARE)
            r->frames[flight->frame] = FRAME_IN_FLIGHT;
        r->in_flight++;
        r->served = ++j->served;
        r->begun_ns = r->begun_ns ? r->begun_ns : clock_now_ns();
        j->in_flight++;
        bool out = r->job.kind == JOB_COMPARE ? compare_out(j, flight, &error)
                                              : frame_out(j, flight, &error);
        if (out)
            continue;
        if (r->job.kind != JOB_COMPARE)
            r->frames[flight->frame] = FRAME_TODO; /* the queue is full: that is nobody's attempt */
        r->due_ns = clock_now_ns() + BACKOFF_NS;
        free_flight(j, flight);
    }
}

/* ---- now and then ---- */

static void expire(struct jobs *j)
{
    uint8_t id[PEN_ID_BYTES];
    struct job_numbers numbers;
    uint64_t now = clock_now_ns();
    if (now < j->expiry_due_ns)
        return;
    j->expiry_due_ns = now + EXPIRY_NS;
    while (!is_draining(j) && job_store_expire(j->store, jobs_now_s(), id)) {
        job_files_remove(j->root, id);
        jobs_tell(j, id, JOB_CHANGED);
    }
    if (!job_store_read(j->store, &numbers, NULL))
        return;
    j->bytes = numbers.bytes; /* clients delete some, too */
    pthread_mutex_lock(&j->lock);
    j->numbers = numbers;
    pthread_mutex_unlock(&j->lock);
}

void jobs_open_store(struct jobs *j)
{
    struct pen_error error = {0};
    char path[4096];
    if (clock_now_ns() < j->open_due_ns)
        return;
    j->open_due_ns = clock_now_ns() + JOBS_OPEN_S * CLOCK_S;
    if (j->root < 0)
        j->root = job_files_open_root(j->config.store, &error);
    snprintf(path, sizeof path, "%s/jobs/jobs.db", j->config.store);
    struct job_store *store = j->root >= 0 ? job_store_open(path, &error) : NULL;
    if (store)
        jobs_recover(j, store);
    pthread_mutex_lock(&j->lock);
    j->store = store;
    j->why_none = error;
    pthread_mutex_unlock(&j->lock);
}

/* Jobs that came since the last time, the oldest first, behind the others. */
static void take_incoming(struct jobs *j)
{
    pthread_mutex_lock(&j->lock);
    struct running **last = &j->first, *list = j->incoming, *turned = NULL;
    j->incoming = NULL;
    while (*last)
        last = &(*last)->next;
    while (list) {
        struct running *r = list;
        list = r->next;
        r->next = turned;
        turned = r;
    }
    *last = turned;
    pthread_mutex_unlock(&j->lock);
    for (struct running *r = turned; r; r = r->next) {
        struct job now; /* it may have been cancelled before it was here to be told */
        if (job_store_get(j->store, r->job.id, &now, NULL) && job_is_over(now.state))
            __atomic_store_n(&r->cancelled, true, __ATOMIC_RELEASE);
    }
}

static uint64_t earlier(uint64_t a, uint64_t b)
{
    return a < b ? a : b;
}

/* When there is something to do without news. */
static uint64_t next_due_ns(const struct jobs *j)
{
    uint64_t now = clock_now_ns(), due = earlier(now + IDLE_NS, j->beat_due_ns);
    if (!j->store)
        return earlier(due, j->open_due_ns);
    for (const struct flight *flight = j->delayed; flight; flight = flight->next)
        due = earlier(due, flight->due_ns);
    for (const struct running *r = j->first; r; r = r->next) {
        if (r->due_ns > now)
            due = earlier(due, r->due_ns);
        if (!r->in_flight && (r->has_failed || is_complete(r)))
            due = earlier(due, j->record_due_ns > now ? j->record_due_ns : now + RECORD_NS);
    }
    return due;
}

/* Waits for news; false: everything is over. */
static bool rest(struct jobs *j)
{
    uint64_t due = next_due_ns(j);
    struct timespec until = {(time_t)(due / CLOCK_S), (long)(due % CLOCK_S)};
    pthread_mutex_lock(&j->lock);
    while (!j->ended && !j->woken && clock_now_ns() < due)
        pthread_cond_timedwait(&j->news, &j->lock, &until);
    j->woken = false;
    bool goes_on = !j->draining || j->in_flight;
    pthread_mutex_unlock(&j->lock);
    return goes_on;
}

static struct flight *take_ended(struct jobs *j)
{
    pthread_mutex_lock(&j->lock);
    struct flight *list = j->ended;
    j->ended = NULL;
    pthread_mutex_unlock(&j->lock);
    return list;
}

void *jobs_run(void *context)
{
    struct jobs *j = context;
    j->beat_due_ns = clock_now_ns() + BEAT_NS;
    do {
        if (!j->store)
            jobs_open_store(j);
        if (j->store) {
            struct flight *delayed = j->delayed;
            take_incoming(j);
            j->delayed = NULL;
            settle_list(j, delayed);
            settle_list(j, take_ended(j));
            end_jobs(j);
            expire(j);
            send_out(j);
        }
        if (clock_now_ns() >= j->beat_due_ns) {
            j->beat_due_ns = clock_now_ns() + BEAT_NS;
            jobs_tell(j, NULL, JOB_BEAT);
        }
    } while (rest(j));
    return NULL;
}
