#include "renderer/passes/light/cascades.h"
#include <cglm/cglm.h>
#include <math.h>
#include <string.h>

#define STEPS 64
#define MOST_STEPS 30000

void cascade_splits(float near_z, float far_z, uint32_t count, enum cascade_split split,
    float lambda, float *bounds)
{
    double n = near_z, f = fmax(far_z, near_z);
    for (uint32_t i = 0; i <= count; i++) {
        double t = (double)i / count, logarithmic = n * pow(f / n, t), z;
        if (split == CASCADE_SPLIT_PAPER)
            z = 0.5 * (logarithmic + n + pow(f - n, t));
        else
            z = lambda * logarithmic + (1 - (double)lambda) * (n + (f - n) * t);
        /* The printed formula adds metres to a number, so for small scenes it can leave the range
         * or fall. */
        z = fmin(fmax(z, i ? bounds[i - 1] : n), f);
        bounds[i] = (float)(i == count ? f : z);
    }
}

void cascade_sample_1d(
    enum cascade_weights mode, uint32_t side, uint32_t i, float *at, float *weight)
{
    float n = (float)side;
    *at = 0;
    *weight = 1;
    if (side == 1)
        return;
    *at = mode == CASCADE_WEIGHTS_CELL_CENTRED ? ((float)i + 0.5f) / n * 2 - 1
                                               : (float)i / (n - 1) * 2 - 1;
    *weight =
        mode == CASCADE_WEIGHTS_TRAPEZOID ? (i == 0 || i == side - 1 ? 0.5f : 1) / (n - 1) : 1 / n;
}

/* A tile's receivers lie in the slab between two view distances under it. In light space the eight
 * corners are origin + distance * ray. */
struct slab {
    float q[2][2]; /* low, high on the map plane, from the emitter's centre */
    float z[2];
};

struct projector {
    const struct light_face *face;
    float eye[3], forward[3], right[3], up[3]; /* light space; right, up: per unit of ndc */
};

static void make_projector(
    struct projector *p, const struct view *view, const struct light_face *face)
{
    float tan_y = tanf(0.5f * view->fov_y_rad);
    p->face = face;
    glm_mat4_mulv3((vec4 *)face->world_to_light, (float *)view->eye, 1, p->eye);
    glm_mat4_mulv3((vec4 *)face->world_to_light, (float *)view->forward, 0, p->forward);
    glm_mat4_mulv3((vec4 *)face->world_to_light, (float *)view->right, 0, p->right);
    glm_mat4_mulv3((vec4 *)face->world_to_light, (float *)view->up, 0, p->up);
    glm_vec3_scale(p->right, tan_y * view->aspect, p->right);
    glm_vec3_scale(p->up, tan_y, p->up);
}

/* How far a sample at distance 1 from the centre moves a receiver at z on the map plane. */
static float shift_of(const struct light_face *face, float z)
{
    return face->parallel ? z : 1 - face->near_z / z;
}

/* F4 per metre of half extent: how far blockers may lie from the receiver. */
static float search_of(const struct light_face *face, float z)
{
    float beyond = fmaxf(z - face->near_z, 0);
    return face->parallel ? beyond : beyond / fmaxf(z, face->near_z);
}

/* False when nothing can shadow the slab: it lies before all casters, or beside their window. */
static bool make_slab(
    const struct projector *p, const float ndc[2][2], float first, float last, struct slab *slab)
{
    const struct light_face *face = p->face;
    float n = face->near_z;
    bool before = false;
    for (int k = 0; k < 2; k++) {
        slab->q[0][k] = slab->z[0] = INFINITY;
        slab->q[1][k] = slab->z[1] = -INFINITY;
    }
    for (int i = 0; i < 8; i++) {
        float distance = i >> 2 ? last : first, c[3];
        for (int k = 0; k < 3; k++)
            c[k] = p->eye[k] + distance * (p->forward[k] + ndc[i & 1][0] * p->right[k] +
                                              ndc[i >> 1 & 1][1] * p->up[k]);
        slab->z[0] = fminf(slab->z[0], c[2]);
        slab->z[1] = fmaxf(slab->z[1], c[2]);
        before |= c[2] < n && !face->parallel;
        for (int k = 0; k < 2; k++) {
            float q = face->parallel ? c[k] : c[k] * n / c[2];
            slab->q[0][k] = fminf(slab->q[0][k], q);
            slab->q[1][k] = fmaxf(slab->q[1][k], q);
        }
    }
    if (slab->z[1] <= n)
        return false;
    slab->z[0] = fmaxf(slab->z[0], n);
    for (int k = 0; k < 2; k++) {
        float reach = face->extent[k] * search_of(face, slab->z[1]);
        float low = face->rect[k] - reach, high = face->rect[2 + k] + reach;
        if (face->cube) /* receivers beyond the pyramid belong to another face */
            low = fmaxf(low, -1.01f * n), high = fminf(high, 1.01f * n);
        if (before) { /* reaches behind the light's near plane: anywhere */
            slab->q[0][k] = low;
            slab->q[1][k] = high;
        }
        slab->q[0][k] = fmaxf(slab->q[0][k], low);
        slab->q[1][k] = fminf(slab->q[1][k], high);
        if (slab->q[0][k] > slab->q[1][k])
            return false;
    }
    return true;
}

/* The tile's borders in ndc, a pixel wider than it is; its view distances. False: background. */
static bool tile_box(const struct view *view, const struct cascade_tiles *tiles, uint32_t tile,
    float ndc[2][2], float distances[2])
{
    const float *depth = tiles->depth[tile];
    uint32_t x = tile % tiles->width * tiles->size, y = tile / tiles->width * tiles->size;
    if (!(depth[1] > 0))
        return false;
    ndc[0][0] = 2 * ((float)x - 1) / (float)view->width - 1;
    ndc[1][0] = 2 * ((float)(x + tiles->size) + 1) / (float)view->width - 1;
    ndc[0][1] = 1 - 2 * ((float)(y + tiles->size) + 1) / (float)view->height;
    ndc[1][1] = 1 - 2 * ((float)y - 1) / (float)view->height;
    distances[0] = view->near_z / depth[1] * 0.999f;
    distances[1] = view->near_z / depth[0] * 1.001f;
    return true;
}

bool cascade_range(const struct view *view, const struct light *light,
    const struct cascade_tiles *tiles, float range[2])
{
    range[0] = INFINITY;
    range[1] = 0;
    for (uint32_t f = 0; f < light->face_count; f++) {
        struct projector p;
        make_projector(&p, view, &light->faces[f]);
        for (uint32_t i = 0; i < tiles->width * tiles->height; i++) {
            float ndc[2][2], distances[2];
            struct slab slab;
            if (!tile_box(view, tiles, i, ndc, distances) ||
                (distances[0] >= range[0] && distances[1] <= range[1]) ||
                !make_slab(&p, ndc, distances[0], distances[1], &slab))
                continue;
            range[0] = fminf(range[0], distances[0]);
            range[1] = fmaxf(range[1], distances[1]);
        }
    }
    if (!(range[1] > 0))
        return false;
    /* Where all receivers are about equally far they belong to the first cascade, whose bounds this
     * moves beyond them. */
    if (range[1] < 1.25f * range[0])
        range[1] = 2.5f * range[1];
    range[0] = exp2f(floorf(log2f(range[0]) * 16) / 16);
    range[1] = exp2f(ceilf(log2f(range[1]) * 16) / 16);
    return true;
}

static void widen(int32_t *low, int32_t *high, float from, float to, float origin, float step)
{
    float a = floorf((from - origin) / step), b = ceilf((to - origin) / step);
    int32_t first = (int32_t)fminf(fmaxf(a, -MOST_STEPS), MOST_STEPS);
    int32_t last = (int32_t)fminf(fmaxf(b, -MOST_STEPS), MOST_STEPS);
    *low = first < *low ? first : *low;
    *high = last > *high ? last : *high;
}

/* Steps of the third bound: of shift_of. */
static void shift_steps(const struct light_face *face, float *origin, float *step)
{
    *origin = face->parallel ? face->near_z : 0;
    *step = (face->parallel ? face->far_z - face->near_z : 1) / STEPS;
}

bool cascade_bounds(const struct view *view, const struct light_face *face,
    const struct cascade_tiles *tiles, float first, float last, struct cascade_bounds *bounds)
{
    struct projector p;
    bool any = false;
    float origin, step;
    shift_steps(face, &origin, &step);
    make_projector(&p, view, face);
    for (int k = 0; k < 3; k++) {
        bounds->low[k] = INT32_MAX;
        bounds->high[k] = INT32_MIN;
    }
    for (uint32_t i = 0; i < tiles->width * tiles->height; i++) {
        float ndc[2][2], distances[2];
        struct slab slab;
        if (!tile_box(view, tiles, i, ndc, distances))
            continue;
        distances[0] = fmaxf(distances[0], first);
        distances[1] = fminf(distances[1], last);
        if (distances[0] > distances[1] || !make_slab(&p, ndc, distances[0], distances[1], &slab))
            continue;
        any = true;
        for (int k = 0; k < 2; k++)
            widen(&bounds->low[k], &bounds->high[k], slab.q[0][k], slab.q[1][k], face->rect[k],
                (face->rect[2 + k] - face->rect[k]) / STEPS);
        widen(&bounds->low[2], &bounds->high[2], shift_of(face, slab.z[0]),
            shift_of(face, slab.z[1]), origin, step);
    }
    return any;
}

bool cascade_window(const struct light_face *face, const float casters[2][3],
    const struct cascade_bounds *bounds, const float sample[2], uint32_t side, uint32_t texels,
    uint32_t size, float rect[4])
{
    float origin, step, all[4];
    shift_steps(face, &origin, &step);
    float shift[2] = {
        origin + (float)bounds->low[2] * step, origin + (float)bounds->high[2] * step};
    float search = face->parallel ? shift[1] - face->near_z : fminf(shift[1], 1);
    light_face_window(face, casters, sample, all);
    for (int k = 0; k < 2; k++) {
        float cell = (face->rect[2 + k] - face->rect[k]) / STEPS;
        float a = sample[k] * shift[0], b = sample[k] * shift[1];
        float margin = face->extent[k] * fmaxf(search, 0) / (float)side;
        float low = face->rect[k] + (float)bounds->low[k] * cell + fminf(a, b) - margin;
        float high = face->rect[k] + (float)bounds->high[k] * cell + fmaxf(a, b) + margin;
        float room = (float)size - 2 * (float)(texels + 1);
        float border = (high - low) * (float)(texels + 1) / fmaxf(room, 0.25f * (float)size);
        rect[k] = fmaxf(low - border, all[k]);
        rect[2 + k] = fminf(high + border, all[2 + k]);
        if (!(rect[k] < rect[2 + k]))
            return false;
        /* A sliver between receivers and casters needs no more than the map's precision. */
        float least = 1e-3f * (all[2 + k] - all[k]), width = rect[2 + k] - rect[k];
        if (width < least) {
            rect[k] -= 0.5f * (least - width);
            rect[2 + k] += 0.5f * (least - width);
        }
    }
    return true;
}
