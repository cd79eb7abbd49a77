#include "renderer/trace/embree/kept.h"
#include <stdlib.h>

void trace_kept_make(struct pen_trace_kept *kept, size_t receivers, bool plain)
{
    size_t bytes = sizeof *kept->counts + (plain ? 0 : sizeof *kept->sums);
    kept->receivers = receivers;
    if (receivers > TRACE_KEPT_MOST / bytes)
        return;
    kept->counts = calloc(receivers, sizeof *kept->counts);
    kept->sums = plain || !kept->counts ? NULL : calloc(receivers, sizeof *kept->sums);
    if (plain || kept->sums)
        return;
    free(kept->counts);
    kept->counts = NULL;
}

void trace_kept_finish(struct pen_trace_kept *kept)
{
    free(kept->verdicts);
    free(kept->full);
    free(kept->counts);
    free(kept->sums);
    *kept = (struct pen_trace_kept){0};
}

struct trace_total trace_kept_recall(
    const struct pen_trace_kept *kept, uint32_t receiver, uint32_t samples)
{
    const struct trace_kept_count *k = &kept->counts[receiver];
    const struct trace_kept_sums *s = kept->sums ? &kept->sums[receiver] : NULL;
    struct trace_total t = {.samples = samples, .count = k->count, .pairs = (double)k->pairs};
    t.weight = s ? s->weight : samples;
    t.visible = s ? s->visible : k->count;
    for (int c = 0; c < 3; c++)
        t.rgb[c] = s ? s->rgb[c] : k->count;
    return t;
}

void trace_kept_put(struct pen_trace_kept *kept, uint32_t receiver, const struct trace_total *total)
{
    kept->counts[receiver] = (struct trace_kept_count){total->count, (float)total->pairs};
    if (kept->sums)
        kept->sums[receiver] = (struct trace_kept_sums){
            total->weight, total->visible, {total->rgb[0], total->rgb[1], total->rgb[2]}};
}

uint32_t pen_trace_kept_samples(const struct pen_trace_kept *kept)
{
    return kept ? kept->samples : 0;
}

uint64_t pen_trace_kept_bytes(size_t receivers, bool plain)
{
    return receivers *
           (2 + sizeof(struct trace_kept_count) + (plain ? 0 : sizeof(struct trace_kept_sums)));
}

void pen_trace_kept_destroy(struct pen_trace_kept *kept)
{
    if (kept)
        trace_kept_finish(kept);
    free(kept);
}
