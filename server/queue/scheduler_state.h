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
bool scheduler_is_late(struct scheduler *s, const struct render *render, uint64_t payer,
    const struct waiter *waiter, struct pen_error *error);
/* One that was measured took so much of the renderer, and so long until it was done. */
void scheduler_learn_ratio(struct scheduler *s, double renderer_ms, double run_ms);
/* Of the first of several, not begun yet: after what its client has before it, they will not all be
 * done in time. */
bool scheduler_is_hopeless(const struct scheduler *s, const struct render *render);
