/* One worker as its thread in the pool sees it, and what the worker says. */
#pragma once
#include "server/base/process.h"
#include "server/queue/homes.h"
#include "server/workers/worker_figures.h"
#include <pthread.h>

/* Renders that take turns, and some that are encoded meanwhile. */
#define IN_TURNS PEN_MAX_RENDERS
#define IN_FLIGHT (IN_TURNS + 2)
_Static_assert(IN_FLIGHT <= CHANNEL_MAX_JOBS, "a worker keeps that many");
#define MAX_DROPS 64

enum phase { PHASE_SENT, PHASE_RENDERING, PHASE_ENCODING };

struct flight {
    struct render *render; /* NULL: free */
    enum phase phase;
    uint64_t since_ns; /* of the phase */
    bool cancelled;    /* the worker was told */
    bool part_wanted;  /* the worker was told, and has not answered yet */
};

struct worker_pool;

struct slot {
    struct worker_pool *pool;
    pthread_t thread;
    int wake; /* eventfd */
    uint32_t index;
    uint8_t drops[MAX_DROPS][PEN_ID_BYTES]; /* guarded by pool->lock */
    uint32_t drop_count;                    /* guarded by pool->lock */
    struct channel_resident resident;       /* guarded by pool->lock */
    struct pen_program_counts programs;     /* guarded by pool->lock */
    /* Only the slot's thread: */
    struct process process;
    int socket;
    bool said_hello, is_replacement, hung;
    bool silent;                            /* its process does not run; guarded by pool->lock */
    uint64_t alive_ns, looked_ns;           /* the last message, the last look for one */
    uint64_t turn_job;                      /* whose turn it is; 0: nobody's */
    bool turning;                           /* it has begun */
    struct pen_place turn_place;            /* where that job was when the turn began */
    uint64_t silence_ns;                    /* the longest between two signs of life lately */
    uint64_t spawned_ns, died_ns, heard_ns; /* heard: the last sign of life */
    uint32_t failures;                      /* in a row, before a hello */
    struct flight flights[IN_FLIGHT];
    uint64_t place;         /* of what it was given last: struct taker */
    uint64_t ended;         /* renders that have left the turns, one way or the other */
    uint64_t kept_free_for; /* the render that waits for room; 0: none */
    uint64_t kept_free_ns;  /* since when */
};

struct worker_pool {
    struct worker_pool_config config;
    struct quarantine *quarantine;
    struct homes *homes;
    pthread_mutex_t lock; /* guards numbers, and what says so in the slots */
    struct worker_pool_numbers numbers;
    bool stopping; /* atomic */
    struct slot slots[16];
    /* Only the first slot's thread: */
    struct process filler; /* of the driver's shader cache */
    uint64_t filler_ns;    /* when it was started; 0: not yet */
};

struct flight *worker_slot_find(struct slot *slot, uint64_t job); /* NULL: it is not in flight */
/* Answers whoever waits for the flight's render; its place is free then. */
void worker_slot_finish(struct slot *slot, struct flight *flight, const struct outcome *outcome);
/* Whether the worker can take it beside what it has: struct taker.fits of a slot. */
enum take worker_slot_fits(void *slot, struct render *render);
/* Reads everything that the worker has said; false when it is to be buried. */
bool worker_slot_hear(struct slot *slot);
