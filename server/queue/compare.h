/* Several methods measured against a reference, on one view of one scene. */
#pragma once
#include "server/queue/scheduler.h"

struct compare;

/* What a run of measurements asks for; kept by the caller until `done`. */
struct compare_plan {
    const struct pen_request *requests; /* [0] is the reference */
    uint32_t count;                     /* with the reference */
    const uint32_t *measures;           /* enum measure, one per request, the first a reference;
                                 NULL: the others are MEASURE_COMPARED */
    uint64_t client;                    /* whose share it uses, as one render; 0: nobody's */
    uint64_t payer;                     /* whose time it takes; 0: the client's */
    uint64_t deadline_ns;               /* of all together; 0: patience_ms for each */
    uint32_t patience_ms;
    bool background; /* see struct waiter */
    /* Called before every request but the first; false leaves it out. May be NULL. */
    bool (*wants)(void *owner, struct compare *compare, uint32_t request);
    bool (*is_gone)(void *owner); /* the client has hung up; may be NULL */
    /* Called once, from any thread. PEN_OK: the measurements are there. Ends with
     * compare_destroy. */
    void (*done)(void *owner, struct compare *compare, const struct pen_error *error);
    void *owner;
};

struct compare_row {
    struct pen_result result;                   /* error.code set: this one could not be rendered */
    struct picture *image, *maps[MEASURE_MAPS]; /* of measurements */
    double run_ms;                              /* on the worker; 0: left out */
};

/* One measurement after the other, so that none disturbs the times of another. They go through the
 * queue like any render: others are served in between, and a worker that dies is replaced. False,
 * with the error, when the first one is not accepted; `done` is then not called. */
bool compare_start(
    struct scheduler *scheduler, const struct compare_plan *plan, struct pen_error *error);
/* One row per request of the plan. */
const struct compare_row *compare_rows(const struct compare *compare);
/* How many requests were through when it ended. */
uint32_t compare_done_count(const struct compare *compare);
void compare_destroy(struct compare *compare); /* NULL is fine */
