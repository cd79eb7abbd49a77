/* What the scheduler's own files share. */
#pragma once
#include "server/queue/scheduler.h"
#include "server/queue/shares.h"
#include <pthread.h>

struct scheduler {
    pthread_mutex_t lock;    /* guards everything below, and the waiters of every render */
    struct render *queue[2]; /* first, last */
    struct render *running;
    struct shares *shares;
    uint64_t next_id;
    struct accounts *accounts;
    struct estimates *estimates;
    double mean_ms; /* of a render on a worker, decaying */
    /* How many times as long as it takes of the renderer something measured keeps a worker's places
     * for measurements: it is compared and encoded there. Decaying. */
    double measured_ratio;
    /* Of the last renders that were made while the renderer was never idle, decaying: how long they
     * took altogether, and what was known of them beforehand to take at least. */
    double paced_ms, foreseen_ms, paced_count;
    uint64_t paced_ns; /* until when it is counted */
    struct scheduler_numbers numbers;
    /* Constant after creation. */
    struct scheduler_limits limits;
    void (*on_work)(void *);
    void *context;
};

/* Under the lock: puts waiters back that were looked at without it. */
void scheduler_put_back(struct render *render, struct waiter *list);

/* ---- forecast.c, all under the lock ---- */

/* What the requests that follow a render will take. */
void scheduler_foresee(
    const struct scheduler *s, struct render *render, const struct waiter *waiter);
/* Everything that is there, on all workers together; a render without an estimate takes
 * `unknown_ms`. */
double scheduler_backlog_ms(const struct scheduler *s, double unknown_ms);
/* When about half of what is there is done. */
uint32_t scheduler_retry_s(const struct scheduler *s);
bool scheduler_is_late(struct scheduler *s, struct render *render, const struct waiter *waiter,
    struct pen_error *error);
/* One that was measured took so much of the renderer, and so long until it was done. */
void scheduler_learn_ratio(struct scheduler *s, double renderer_ms, double run_ms);
/* A render begins, with nothing under way, or has ended; `counts`: it was made as it was foreseen to be. */
void scheduler_pace_begin(struct scheduler *s);
void scheduler_pace(struct scheduler *s, const struct render *render, bool counts, double ms);
/* Not begun yet: after what its client has before it, it, and what follows it, will not be done in
 * time. */
bool scheduler_is_hopeless(const struct scheduler *s, const struct render *render);
