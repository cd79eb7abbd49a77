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
    struct scheduler_numbers numbers;
    /* Constant after creation. */
    struct scheduler_limits limits;
    void (*on_work)(void *);
    void *context;
};

/* Under the lock: puts waiters back that were looked at without it. */
void scheduler_put_back(struct render *render, struct waiter *list);
