/* A job's points, block by block. */
#include "renderer/trace/points.h"
#include <stdlib.h>

static uint32_t log2_floor(uint32_t x)
{
    return 31 - (uint32_t)__builtin_clz(x);
}

uint32_t trace_points_round(uint32_t samples)
{
    return 1u << log2_floor(2 * samples - 1);
}

static void make_rim(struct trace_points *p, uint32_t first, bool round)
{
    for (uint32_t i = 0; i < TRACE_PRETEST_RIM; i++) {
        int32_t far_u = i & 1 ? INT32_MAX : -INT32_MAX, far_v = i & 2 ? INT32_MAX : -INT32_MAX;
        p->u[first + i] = round && (i == 0 || i == 3) ? 0 : far_u;
        p->v[first + i] = round && (i == 1 || i == 2) ? 0 : far_v;
    }
}

bool trace_points_make(
    struct trace_points *p, uint32_t samples, bool round, uint32_t seed, struct pen_error *error)
{
    uint32_t net = samples, rim = net + TRACE_PRETEST_NET, total = rim + TRACE_PRETEST_RIM;
    uint32_t *xs = malloc(2 * (size_t)total * sizeof *xs), *ys = xs ? xs + total : NULL;
    uint32_t block = samples > TRACE_FIRST_BLOCK ? TRACE_FIRST_BLOCK : samples;
    uint32_t early = TRACE_PRETEST_FIRST, late = TRACE_PRETEST_NET - early;
    if (!xs)
        return pen_fail(error, PEN_UNAVAILABLE, "", "Out of memory.");
    *p = (struct trace_points){.u = (int32_t *)xs,
        .v = (int32_t *)ys,
        .samples = samples,
        .total = total,
        .low_bits = 0xffffffffu >> (log2_floor(block) / 2),
        .pretest_low_bits = 0xffffffffu >> (log2_floor(TRACE_PRETEST_FIRST) / 2)};
    bool ok = trace_samples_net(0, early, ~seed, xs + net, ys + net);
    for (uint32_t first = early; first < TRACE_PRETEST_NET && ok; first *= 2)
        ok = trace_samples_net(first, first, ~seed, xs + net + first, ys + net + first);
    for (uint32_t first = 0; first < samples && ok; first += block) {
        if (first > block) /* the second is as long as the first, each then as all before it */
            block = first;
        ok = trace_samples_net(first, block, seed, xs + first, ys + first);
        p->blocks[p->block_count++] = (struct trace_block){p->u + first, p->v + first, block};
    }
    if (!ok) {
        trace_points_finish(p);
        return pen_fail(error, PEN_UNAVAILABLE, "", "Out of memory.");
    }
    for (uint32_t i = 0; i < rim; i++) { /* from [0,1) to [-1,1) */
        xs[i] ^= 0x80000000u;
        ys[i] ^= 0x80000000u;
    }
    make_rim(p, rim, round);
    p->pretest[0] = (struct trace_block){p->u + net, p->v + net, early};
    p->pretest[1] = (struct trace_block){p->u + net + early, p->v + net + early, late};
    p->rim = (struct trace_block){p->u + rim, p->v + rim, TRACE_PRETEST_RIM};
    return true;
}

void trace_points_finish(struct trace_points *p)
{
    free(p->u);
    *p = (struct trace_points){0};
}
