/* Threads over numbered items. */
#pragma once
#include "renderer/trace/trace.h"

/* run(context, item) is to be called for every item below `count`. */
struct trace_work {
    void (*run)(void *context, uint32_t item);
    void *context;
    uint32_t count;
    /* As pen_trace_job has them; NULL: it is done in one go. */
    bool (*turn)(void *context);
    double turn_ms;
    /* Called first, while the other threads are at it already; false as from `turn`. May be NULL. */
    bool (*beside)(void *context, struct pen_trace_crew *crew);
};
/* On `threads` threads, the caller's among them, with denormals flushed. Adds their processor time to
 * *cpu_seconds. False: a turn said so, and items are left out. */
bool trace_parallel(uint32_t threads, const struct trace_work *work, double *cpu_seconds);
/* `threads`, or how many this process may use when that is 0. */
uint32_t trace_thread_count(uint32_t threads);
double trace_seconds(void);
