/* What the files of this folder share. The picture is worked on in tiles of 16 x 16, in halves of
 * them (8 x 8: the pre-test and the pattern of points), and in blocks of 4 x 4: a packet of rays. */
#pragma once
#include "renderer/trace/denoise/denoised.h"
#include "renderer/trace/embree/packet.h"
#include "renderer/trace/embree/verdicts.h"

#define TILE 16u
#define HALF 8u
#define BLOCK 4u

struct denoise {
    struct trace_pieces pieces; /* first, as trace_in_pieces wants it */
    const struct pen_trace_job *job;
    const struct pen_trace_denoising *how;
    uint16_t *halves;
    uint16_t lit[4], dark[4]; /* what is wholly so, in halves */
    struct trace_emitter emitter;
    float mean_emission[3];
    float size;     /* of the light or the smallest thing in its picture, m; parallel: tangent */
    float pixel;    /* a pixel's size on what it shows, times the depth */
    uint32_t mode;  /* enum trace_mode */
    uint32_t parts; /* floats per value: 1: a; 4: rgb, too */
    uint32_t tiles_x, tiles, halves_x, halves_y, blocks_x, blocks_y;
    uint32_t samples, refine, more_low_bits;
    bool capped;                     /* what is narrow is filtered all the same */
    int32_t *points;                 /* u and v: of each block of 4 in a pattern, sample and lane */
    int32_t look[2][4][TRACE_LANES]; /* u and v: of them one for each pixel, of unlike strata */
    int32_t *more_points;            /* u and v: `refine` each */
    uint8_t *verdicts, *marks;       /* per half: enum verdict */
    uint8_t *work, *near;            /* per half: it gets rays; it may be looked at from there */
    float *reach;                    /* per block: px; INFINITY: nothing is in the way */
    uint8_t *radius;                 /* per block, of the filter: px */
    /* Per pixel: */
    float *value[2];      /* mean over samples above the horizon; the second: filtered in x */
    float *fade;          /* where there is work */
    uint8_t *above;       /* samples above the horizon */
    uint8_t *wanted;      /* 1: it gets more rays */
    int8_t (*normals)[4]; /* where `near`: of length 127; 0: no receiver */
    _Atomic uint64_t rays, receivers, worked, narrow;
};

/* Work on one tile, one after the other on all: */
void denoise_pretest(void *context, uint32_t tile);
void denoise_sample(void *context, uint32_t tile);
void denoise_plan(void *context, uint32_t tile); /* radius and wanted */
void denoise_refine(void *context, uint32_t tile);
void denoise_filter_x(void *context, uint32_t tile);
void denoise_filter_y(void *context, uint32_t tile); /* into `halves` */

/* Number of the half that a pixel is in. */
static inline uint32_t denoise_half(const struct denoise *d, uint32_t x, uint32_t y)
{
    return y / HALF * d->halves_x + x / HALF;
}

/* Top left pixel of a tile. */
static inline void denoise_tile_at(const struct denoise *d, uint32_t tile, uint32_t at[2])
{
    at[0] = tile % d->tiles_x * TILE;
    at[1] = tile / d->tiles_x * TILE;
}
