/* The inner loop of pen_trace_visibility. Compiled with -O3: the lane loops are meant to become
 * vector instructions of whatever the target has. */
#include "renderer/trace/embree/packet.h"
#include <math.h>
#include <string.h>

#define LANES TRACE_LANES
#define FAR 0.9999f /* ends just before the light, which may be a mesh itself */

/* Shirley & Chiu 1997, without branches. */
static inline void disk_point(float *u, float *v)
{
    float a = *u, b = *v;
    bool tall = fabsf(b) > fabsf(a);
    float radius = tall ? b : a, other = tall ? a : b;
    float ratio = radius != 0 ? other / radius : 0; /* in [-1,1] */
    float t = ratio * 0.78539816f, t2 = t * t;
    float sine = t * (1 + t2 * (-1.0f / 6 + t2 * (1.0f / 120 - t2 * (1.0f / 5040))));
    float cosine = 1 + t2 * (-0.5f + t2 * (1.0f / 24 + t2 * (-1.0f / 720 + t2 * (1.0f / 40320))));
    *u = radius * (tall ? sine : cosine);
    *v = radius * (tall ? cosine : sine);
}

void trace_disk_point(float *u, float *v)
{
    disk_point(u, v);
}

static const float *texel(const struct trace_emitter *e, int32_t x, int32_t y)
{
    int32_t w = (int32_t)e->columns, h = (int32_t)e->rows;
    x = x < 0 ? 0 : x >= w ? w - 1 : x;
    y = y < 0 ? 0 : y >= h ? h - 1 : y;
    return e->emission + 4 * ((size_t)y * e->columns + (size_t)x);
}

void trace_emission_at(const struct trace_emitter *e, float u, float v, float rgb[3])
{
    if (!e->emission) {
        rgb[0] = rgb[1] = rgb[2] = 1;
        return;
    }
    float s = (0.5f * u + 0.5f) * (float)e->columns, t = (0.5f * v + 0.5f) * (float)e->rows;
    if (!e->bilinear) {
        memcpy(rgb, texel(e, (int32_t)floorf(s), (int32_t)floorf(t)), 3 * sizeof *rgb);
        return;
    }
    float fx = floorf(s - 0.5f), fy = floorf(t - 0.5f);
    float ax = s - 0.5f - fx, ay = t - 0.5f - fy;
    const float *t00 = texel(e, (int32_t)fx, (int32_t)fy);
    const float *t10 = texel(e, (int32_t)fx + 1, (int32_t)fy);
    const float *t01 = texel(e, (int32_t)fx, (int32_t)fy + 1);
    const float *t11 = texel(e, (int32_t)fx + 1, (int32_t)fy + 1);
    for (int c = 0; c < 3; c++) {
        float low = t00[c] + ax * (t10[c] - t00[c]), high = t01[c] + ax * (t11[c] - t01[c]);
        rgb[c] = low + ay * (high - low);
    }
}

/* A frame whose z is the unit vector `to`, turned from the light's own by the smallest rotation, so
 * that a texture stays put as the receiver moves. */
static void facing_frame(const struct trace_emitter *e, const float to[3], float a[3], float b[3])
{
    float c = trace_dot(e->z, to), axis[3];
    trace_cross(e->z, to, axis);
    float k = c > -0.9999f ? 1 / (1 + c) : 0;
    const float *from[2] = {e->a, e->b};
    float *out[2] = {a, b};
    for (int i = 0; i < 2; i++) {
        float side[3], along = trace_dot(axis, from[i]) * k;
        trace_cross(axis, from[i], side);
        for (int d = 0; d < 3; d++) /* Rodrigues: c f + axis x f + axis (axis . f) / (1 + c) */
            out[i][d] =
                k > 0 ? c * from[i][d] + side[d] + axis[d] * along : (i ? -from[i][d] : from[i][d]);
    }
}

/* Sets lane `lane`; returns whether any light point can be in front of the receiver. */
static bool load_lane(struct trace_packet *p, const struct trace_emitter *e,
    const struct trace_receiver *r, uint32_t lane)
{
    float base[3], a[3], b[3], front;
    memcpy(a, e->a, sizeof a);
    memcpy(b, e->b, sizeof b);
    for (int c = 0; c < 3; c++)
        base[c] = e->type == PEN_TRACE_SUN ? -e->z[c] : e->origin[c] - r->position[c];
    front = e->type == PEN_TRACE_SUN ? 1 : -trace_dot(base, e->z);
    float distance = sqrtf(trace_dot(base, base));
    if (e->type == PEN_TRACE_SPHERE || e->type == PEN_TRACE_POINT) {
        float to[3] = {0};
        for (int c = 0; c < 3; c++)
            to[c] = -base[c] / distance;
        if (e->type == PEN_TRACE_SPHERE)
            facing_frame(e, to, a, b);
        else if (trace_dot(to, e->z) < e->cos_cone)
            return false;
        front = distance;
    }
    if (!(distance > 0) || !(front > 0))
        return false;
    p->front[lane] = front;
    p->cos_base[lane] = trace_dot(r->normal, base);
    p->cos_a[lane] = trace_dot(r->normal, a);
    p->cos_b[lane] = trace_dot(r->normal, b);
    for (int c = 0; c < 3; c++) {
        float lift = r->bias * r->normal[c];
        float *origin = c == 0 ? p->ray.org_x : c == 1 ? p->ray.org_y : p->ray.org_z;
        origin[lane] = r->position[c] + lift;
        p->base[c][lane] = e->type == PEN_TRACE_SUN ? base[c] : base[c] - lift;
        p->a[c][lane] = a[c];
        p->b[c][lane] = b[c];
    }
    return p->cos_base[lane] + fabsf(p->cos_a[lane]) + fabsf(p->cos_b[lane]) > 0;
}

void trace_packet_load(struct trace_packet *p, const struct trace_emitter *e,
    const struct trace_receiver *receivers, uint32_t count, uint32_t seed, uint32_t low_bits)
{
    memset(p, 0, sizeof *p);
    for (uint32_t lane = 0; lane < count; lane++) {
        uint32_t h = trace_hash(receivers[lane].pixel ^ trace_hash(seed));
        p->shift_u[lane] = (int32_t)(h & low_bits);
        p->shift_v[lane] = (int32_t)(trace_hash(h ^ 0x68bc21ebu) & low_bits);
        p->ray.id[lane] = lane;
        p->ray.mask[lane] = ~0u;
        p->active[lane] = load_lane(p, e, &receivers[lane], lane) ? -1 : 0;
        p->any_active |= p->active[lane] != 0;
    }
}

/* Directions to one sample of all lanes, or (TRACE_OWN_POINTS) to one of each; returns how many lanes
 * have it in front. */
static inline __attribute__((always_inline)) int aim(struct trace_packet *p,
    const struct trace_emitter *e, const int32_t *su, const int32_t *sv, uint32_t mode, bool disk,
    bool own_frame, bool sun, float u[LANES], float v[LANES], int32_t valid[LANES])
{
    int valid_count = 0;
    bool own = mode & TRACE_OWN_POINTS, shifted = !(mode & (TRACE_UNSHIFTED | TRACE_OWN_POINTS));
    for (int l = 0; l < LANES; l++) {
        float pu = (float)(own ? su[l] : shifted ? *su ^ p->shift_u[l] : *su) * 0x1p-31f;
        float pv = (float)(own ? sv[l] : shifted ? *sv ^ p->shift_v[l] : *sv) * 0x1p-31f;
        if (disk)
            disk_point(&pu, &pv);
        u[l] = pu;
        v[l] = pv;
    }
    for (int l = 0; l < LANES; l++) {
        float pu = u[l], pv = v[l];
        p->ray.dir_x[l] = p->base[0][l] + pu * (own_frame ? p->a[0][l] : e->a[0]) +
                          pv * (own_frame ? p->b[0][l] : e->b[0]);
        p->ray.dir_y[l] = p->base[1][l] + pu * (own_frame ? p->a[1][l] : e->a[1]) +
                          pv * (own_frame ? p->b[1][l] : e->b[1]);
        p->ray.dir_z[l] = p->base[2][l] + pu * (own_frame ? p->a[2][l] : e->a[2]) +
                          pv * (own_frame ? p->b[2][l] : e->b[2]);
        p->ray.tfar[l] = sun ? INFINITY : FAR;
        float cosine = p->cos_base[l] + pu * p->cos_a[l] + pv * p->cos_b[l];
        valid[l] = cosine > 0 ? p->active[l] : 0;
        valid_count -= valid[l];
    }
    return valid_count;
}

/* The sums that need the sample's weight or colour. */
static void add_weighted(struct trace_packet *p, const struct trace_emitter *e, uint32_t mode,
    const float u[LANES], const float v[LANES], const float share[LANES], float weight[LANES],
    struct trace_sums *sums)
{
    for (int l = 0; l < LANES; l++) {
        float w = 1;
        if (mode & TRACE_WEIGHTS) {
            float d2 = p->ray.dir_x[l] * p->ray.dir_x[l] + p->ray.dir_y[l] * p->ray.dir_y[l] +
                       p->ray.dir_z[l] * p->ray.dir_z[l];
            float cosine = p->cos_base[l] + u[l] * p->cos_a[l] + v[l] * p->cos_b[l];
            w = p->active[l] && cosine > 0 ? cosine * p->front[l] / (d2 * d2) : 0;
        }
        weight[l] = w;
        sums->weight[l] += w;
        sums->visible[l] += share[l] * w;
    }
    if (mode & TRACE_COLOUR)
        for (int l = 0; l < LANES; l++) {
            float rgb[3];
            if (share[l] == 0)
                continue;
            trace_emission_at(e, u[l], v[l], rgb);
            for (int c = 0; c < 3; c++)
                sums->rgb[c][l] += share[l] * weight[l] * rgb[c];
        }
}

static void clear_shares(struct trace_context *query)
{
    for (int l = 0; l < LANES; l++) {
        query->share[l] = 1;
        query->nearest[l] = INFINITY;
    }
}

static inline __attribute__((always_inline)) void run(const struct trace_emitter *e,
    struct trace_packet *p, const struct trace_block *block, uint32_t mode, struct trace_sums *sums,
    bool disk, bool own_frame, bool sun)
{
    struct trace_context query;
    embree_context_init(&query.embree);
    float u[LANES], v[LANES], weight[LANES] = {0}, last_weight[LANES] = {0};
    float share[LANES] = {0}, last_share[LANES] = {0};
    int32_t valid[LANES] __attribute__((aligned(64)));
    int32_t seen[LANES], last[LANES] = {0}, count[LANES] = {0}, pairs[LANES] = {0};
    int32_t above[LANES] = {0};
    uint32_t stride = mode & TRACE_OWN_POINTS ? LANES : 1;
    for (uint32_t i = 0; i < block->count; i++) {
        int in_front = aim(p, e, block->u + stride * i, block->v + stride * i, mode, disk,
            own_frame, sun, u, v, valid);
        if (in_front && !(mode & TRACE_ASSUME_VISIBLE)) {
            if (mode & TRACE_SHARES)
                clear_shares(&query);
            embree_occluded16(valid, e->scene, &query.embree, &p->ray);
            sums->rays += (uint32_t)in_front;
        }
        for (int l = 0; l < LANES; l++) {
            seen[l] = p->ray.tfar[l] > 0 ? valid[l] : 0;
            share[l] = (float)-seen[l];
            above[l] -= valid[l];
        }
        if ((mode & TRACE_SHARES) && in_front && !(mode & TRACE_ASSUME_VISIBLE))
            for (int l = 0; l < LANES; l++) {
                share[l] *= query.share[l];
                seen[l] = share[l] == 1 ? -1 : 0;
            }
        for (int l = 0; l < LANES; l++)
            count[l] -= seen[l];
        if (mode & (TRACE_COLOUR | TRACE_WEIGHTS | TRACE_SHARES))
            add_weighted(p, e, mode, u, v, share, weight, sums);
        if (!(i & 1)) {
            memcpy(last, seen, sizeof last);
            memcpy(last_share, share, sizeof share);
            memcpy(last_weight, weight, sizeof weight);
        } else if (mode & (TRACE_WEIGHTS | TRACE_SHARES)) {
            for (int l = 0; l < LANES; l++) {
                float mean = 0.5f * (weight[l] + last_weight[l]) * (share[l] - last_share[l]);
                sums->pairs[l] += mean * mean;
            }
        } else {
            for (int l = 0; l < LANES; l++)
                pairs[l] -= seen[l] ^ last[l];
        }
    }
    for (int l = 0; l < LANES; l++) {
        sums->count[l] += (uint32_t)count[l];
        sums->above[l] += (uint32_t)above[l];
        sums->pairs[l] += (float)pairs[l];
    }
}

void trace_packet_run(const struct trace_emitter *e, struct trace_packet *p,
    const struct trace_block *block, uint32_t mode, struct trace_sums *sums)
{
    if (!p->any_active)
        return;
    switch (e->type) {
    case PEN_TRACE_DISK:
        run(e, p, block, mode, sums, true, false, false);
        break;
    case PEN_TRACE_SPHERE:
        run(e, p, block, mode, sums, true, true, false);
        break;
    case PEN_TRACE_SUN:
        run(e, p, block, mode, sums, true, false, true);
        break;
    default: /* a point is a rectangle without extent */
        run(e, p, block, mode, sums, false, false, false);
    }
}

void trace_packet_nearest(const struct trace_emitter *e, struct trace_packet *p,
    const int32_t u[LANES], const int32_t v[LANES], struct trace_nearest *out)
{
    struct trace_context query;
    struct RTCRayHit16 ray;
    float at_u[LANES], at_v[LANES];
    bool round = e->type == PEN_TRACE_DISK || e->type == PEN_TRACE_SPHERE,
         sun = e->type == PEN_TRACE_SUN;
    int in_front = 0;
    embree_context_init(&query.embree);
    clear_shares(&query);
    memset(out->above, 0, sizeof out->above);
    if (p->any_active)
        in_front = aim(p, e, u, v, TRACE_OWN_POINTS, round || sun, e->type == PEN_TRACE_SPHERE, sun,
            at_u, at_v, out->above);
    memcpy(&ray.ray, &p->ray, sizeof ray.ray);
    for (int l = 0; l < LANES; l++)
        ray.hit.geomID[l] = ray.hit.instID[0][l] = RTC_INVALID_GEOMETRY_ID;
    if (in_front)
        embree_intersect16(out->above, e->scene, &query.embree, &ray, false);
    out->rays = (uint32_t)in_front;
    for (int l = 0; l < LANES; l++) {
        bool hit = out->above[l] && ray.hit.geomID[l] != RTC_INVALID_GEOMETRY_ID;
        out->share[l] = hit || !out->above[l] ? 0 : query.share[l];
        out->distance[l] = fminf(hit ? ray.ray.tfar[l] : INFINITY, query.nearest[l]);
    }
}
