/* Sixteen receivers against one light: the inner loop. */
#pragma once
#include "renderer/trace/embree/internal.h"

#define TRACE_LANES 16

/* A light, ready for the inner loop. */
struct trace_emitter {
    uint32_t type;
    float origin[3], a[3], b[3], z[3]; /* a = x half[0], b = y half[1] */
    float half[2];
    float cos_cone;
    const float *emission;
    uint32_t columns, rows;
    bool bilinear;
    RTCScene scene; /* what casts for this light */
};

struct trace_emitter trace_emitter_of(const struct pen_trace_light *light); /* scene is left NULL */
/* What of it decides which triangles can cast. */
struct trace_silhouette trace_silhouette_of(const struct trace_emitter *emitter);
/* The mean of its emission: exact for rectangles, to about 1e-4 for disks. */
bool trace_emitter_average(
    const struct trace_emitter *emitter, float mean[3], struct pen_error *error);

struct trace_packet {
    struct RTCRay16 ray;
    float base[3][TRACE_LANES];                 /* from the ray's origin to the light's centre */
    float a[3][TRACE_LANES], b[3][TRACE_LANES]; /* sphere: the disk that faces this receiver */
    float cos_base[TRACE_LANES], cos_a[TRACE_LANES], cos_b[TRACE_LANES]; /* dots with the normal */
    float front[TRACE_LANES]; /* distance in front of the emitter's plane */
    int32_t shift_u[TRACE_LANES], shift_v[TRACE_LANES];
    int32_t active[TRACE_LANES]; /* -1: some light point is in front; 0: V = 0 or no receiver */
    bool any_active;
};

/* Sums over samples; in TRACE_COUNT_ONLY only `count`, `pairs` and `rays` are kept. V of a sample is 0
 * or 1, or with TRACE_SHARES the share of its light that blended surfaces let through. */
struct trace_sums {
    uint32_t count[TRACE_LANES]; /* wholly visible samples */
    uint32_t above[TRACE_LANES]; /* samples above the receiver's horizon */
    float pairs[TRACE_LANES];    /* over pairs: (difference of V, times the pair's mean weight)^2 */
    float weight[TRACE_LANES], visible[TRACE_LANES]; /* sum w, sum w V */
    float rgb[3][TRACE_LANES];                       /* sum w e V */
    uint64_t rays;
};

/* One receiver of a packet; `pixel` seeds its sample shift. */
struct trace_receiver {
    float position[3], normal[3]; /* the normal unit */
    float bias;
    uint32_t pixel;
};

/* As octahedral.glsl has it; of any length. */
void trace_normal_decode(const uint16_t e[2], float n[3]);
/* Receiver `pixel` of a job; false when it is none. `extent`: the scene's. */
bool trace_receiver_read(
    const struct pen_trace_job *job, float extent, uint32_t pixel, struct trace_receiver *out);
/* False for a job or a light that cannot be traced. */
bool trace_job_check(
    const struct pen_trace_light *light, const struct pen_trace_job *job, struct pen_error *error);

/* Loads `count` <= 16 receivers; `low_bits`: which bits of a sample a receiver may shift. */
void trace_packet_load(struct trace_packet *packet, const struct trace_emitter *emitter,
    const struct trace_receiver *receivers, uint32_t count, uint32_t seed, uint32_t low_bits);

enum trace_mode {
    TRACE_COUNT_ONLY = 0,
    TRACE_COLOUR = 1,         /* sum emission */
    TRACE_WEIGHTS = 2,        /* weight by G */
    TRACE_ASSUME_VISIBLE = 4, /* shoot no rays */
    TRACE_UNSHIFTED = 8,      /* take the points as they are */
    TRACE_SHARES = 16,        /* there are blended surfaces */
    TRACE_OWN_POINTS = 32,    /* a block has TRACE_LANES points for each of its count */
};

/* Adds the block's samples to *sums. */
void trace_packet_run(const struct trace_emitter *emitter, struct trace_packet *packet,
    const struct trace_block *block, uint32_t mode, struct trace_sums *sums);

/* Of one ray per lane: what stops it. */
struct trace_nearest {
    int32_t above[TRACE_LANES]
        __attribute__((aligned(64))); /* -1: its point is above the horizon */
    float share[TRACE_LANES];         /* of its light that arrives */
    float distance
        [TRACE_LANES]; /* to the nearest surface in its way, of that to the light; parallel: m;
                                    INFINITY: there is none */
    uint32_t rays;
};
/* Towards point (u[l], v[l]) for lane l, as fractions. */
void trace_packet_nearest(const struct trace_emitter *emitter, struct trace_packet *packet,
    const int32_t u[TRACE_LANES], const int32_t v[TRACE_LANES], struct trace_nearest *nearest);

/* Emission at (u, v) in [-1,1]. */
void trace_emission_at(const struct trace_emitter *emitter, float u, float v, float rgb[3]);
/* The unit square's point (u, v) in [-1,1] on the unit disk, areas kept. */
void trace_disk_point(float *u, float *v);
