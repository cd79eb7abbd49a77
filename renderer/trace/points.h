/* The points of a light that shadow rays aim at: one set for the CPU and for shaders. No
 * GL, no Embree. */
#pragma once
#include "protocol/error.h"
#include <stdbool.h>
#include <stdint.h>

#define TRACE_MAX_SAMPLES 65536u
#define TRACE_MAX_BLOCKS 16
#define TRACE_FIRST_BLOCK 64u /* samples */
#define TRACE_STOP_AFTER 256u /* samples before a receiver may stop early */
#define TRACE_PRETEST_NET 16u
#define TRACE_PRETEST_FIRST 4u /* of them a net, too, and the first */
#define TRACE_PRETEST_RIM 4u
#define TRACE_DILATION 4u          /* of what the pre-test finds mixed, receivers */
#define TRACE_LEAST_SHARE 0x1p-12f /* of its light that a ray may bring: with less it is stopped */

/* Sample points as signed 32-bit fractions of [-1,1]. Points 2k and 2k + 1 share a stratum. */
struct trace_block {
    const int32_t *u, *v;
    uint32_t count;
};

/* All points of a job. Low bits: which bits of a point a receiver may shift by a digital XOR of its
 * own, so that the stratification of a block stays whole. */
struct trace_points {
    int32_t *u, *v;                              /* `total` each */
    uint32_t samples, total;                     /* total: with those of the pre-test */
    struct trace_block blocks[TRACE_MAX_BLOCKS]; /* one after the other from point 0 */
    struct trace_block pretest[2], rim; /* a net, its beginning first; the light's corners */
    uint32_t block_count, low_bits, pretest_low_bits;
};

/* `samples` a power of two up to TRACE_MAX_SAMPLES, in blocks of 64, 64, 128, 256, ...: each a net,
 * and so is what lies before its end. `round`: the light is a disk, whose corners are
 * its four quarters. Errors: PEN_INTERNAL when memory is short. */
bool trace_points_make(struct trace_points *points, uint32_t samples, bool round, uint32_t seed,
    struct pen_error *error);
void trace_points_finish(struct trace_points *points); /* harmless on a zeroed one */

/* `samples` rounded up to a power of two. */
uint32_t trace_points_round(uint32_t samples);

/* Fills xs and ys with points [first, first + count) of an Owen-scrambled Sobol sequence as 32-bit
 * fractions, count a power of two that divides first: a (0, log2 count, 2)-net in base 2. Points
 * 2k and 2k + 1 share one of count / 2 equal cells of the unit square, and cells are in order. */
bool trace_samples_net(uint32_t first, uint32_t count, uint32_t seed, uint32_t *xs, uint32_t *ys);

/* Point `index` of the sequence, every beginning of which is well spread. */
void trace_sample_at(uint32_t index, uint32_t seed, uint32_t *x, uint32_t *y);

static inline uint32_t trace_hash(uint32_t x)
{
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    return x ^ (x >> 16);
}
