/* What receivers have gathered, from block to block of a job and from one job to the next. */
#pragma once
#include "renderer/trace/trace.h"

#define TRACE_KEPT_MOST (512u << 20) /* bytes */
#define TRACE_DONE (-1.0f)           /* for `pairs`: the receiver wants no more */

/* Of one receiver, over the blocks it has had. */
struct trace_total {
    uint32_t samples, count;
    double weight, visible, rgb[3], pairs;
};

struct trace_kept_count {
    uint32_t count;
    float pairs;
};
struct trace_kept_sums {
    double weight, visible, rgb[3];
};

/* One of each per receiver, or NULL. */
struct pen_trace_kept {
    uint8_t *verdicts; /* adaptive: enum verdict */
    uint8_t *full;     /* adaptive: 1 where all samples are wanted */
    struct trace_kept_count *counts;
    struct trace_kept_sums *sums; /* NULL: nothing is weighted or coloured */
    size_t receivers;
    uint32_t samples, blocks; /* that all have had who want all */
};

/* Room for counts, and for sums unless `plain`, if it is not too much. */
void trace_kept_make(struct pen_trace_kept *kept, size_t receivers, bool plain);
void trace_kept_finish(struct pen_trace_kept *kept); /* frees what it points at */
struct trace_total trace_kept_recall(
    const struct pen_trace_kept *kept, uint32_t receiver, uint32_t samples);
void trace_kept_put(
    struct pen_trace_kept *kept, uint32_t receiver, const struct trace_total *total);
