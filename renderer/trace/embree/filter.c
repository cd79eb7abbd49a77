/* Which hits count: facing and alpha. */
#include "renderer/trace/embree/internal.h"
#include <math.h>

/* Wrapped texel number of texel `i` of `size`. */
static uint32_t wrap_texel(int32_t i, int32_t size, uint32_t mode)
{
    if (mode == PSC_CLAMP)
        return (uint32_t)(i < 0 ? 0 : i >= size ? size - 1 : i);
    int32_t period = mode == PSC_MIRROR ? 2 * size : size;
    i %= period;
    if (i < 0)
        i += period;
    return (uint32_t)(i < size ? i : period - 1 - i);
}

/* Brings a coordinate near the image, so that it fits an integer. */
static float reduce_coordinate(float t, uint32_t mode)
{
    if (mode == PSC_REPEAT)
        return t - floorf(t);
    if (mode == PSC_MIRROR)
        return t - 2 * floorf(0.5f * t);
    return fminf(fmaxf(t, -1), 2);
}

static float sample_texture(const struct trace_alpha_material *m, float s, float t)
{
    s = reduce_coordinate(s, m->wrap_s) * (float)m->width;
    t = reduce_coordinate(t, m->wrap_t) * (float)m->height;
    int32_t w = (int32_t)m->width, h = (int32_t)m->height;
    if (m->nearest) {
        uint32_t x = wrap_texel((int32_t)floorf(s), w, m->wrap_s);
        uint32_t y = wrap_texel((int32_t)floorf(t), h, m->wrap_t);
        return (float)m->texels[(size_t)y * m->width + x] / 255;
    }
    float fx = floorf(s - 0.5f), fy = floorf(t - 0.5f);
    float ax = s - 0.5f - fx, ay = t - 0.5f - fy;
    uint32_t x0 = wrap_texel((int32_t)fx, w, m->wrap_s);
    uint32_t x1 = wrap_texel((int32_t)fx + 1, w, m->wrap_s);
    uint32_t y0 = wrap_texel((int32_t)fy, h, m->wrap_t);
    uint32_t y1 = wrap_texel((int32_t)fy + 1, h, m->wrap_t);
    const uint8_t *row0 = m->texels + (size_t)y0 * m->width;
    const uint8_t *row1 = m->texels + (size_t)y1 * m->width;
    float top = (float)row0[x0] + ax * (float)(row0[x1] - row0[x0]);
    float bottom = (float)row1[x0] + ax * (float)(row1[x1] - row1[x0]);
    return (top + ay * (bottom - top)) / 255;
}

float trace_alpha_at(const struct trace_alpha *alpha, uint32_t primitive, float u, float v)
{
    const uint32_t *corner = alpha->indices[primitive];
    const struct trace_alpha_material *m = &alpha->table[alpha->materials[primitive]];
    float weight[3] = {1 - u - v, u, v}, s = 0, t = 0, a = 0;
    for (int k = 0; k < 3; k++) {
        s += weight[k] * alpha->uv[corner[k]][0];
        t += weight[k] * alpha->uv[corner[k]][1];
        a += weight[k] * alpha->vertex_alpha[corner[k]];
    }
    a *= m->factor;
    return m->texels ? a * sample_texture(m, s, t) : a;
}

/* Embree hands packets of any width N as rows of N numbers; its accessors are C++ only. */
enum ray_row { RAY_DIR_X = 4, RAY_DIR_Y, RAY_DIR_Z, RAY_FAR = 8, RAY_ID = 10 };
enum hit_row { HIT_NG_X, HIT_NG_Y, HIT_NG_Z, HIT_U, HIT_V, HIT_PRIMITIVE };

static inline float float_at(const void *rows, uint32_t row, uint32_t n, uint32_t i)
{
    return ((const float *)rows)[row * n + i];
}

static inline uint32_t uint_at(const void *rows, uint32_t row, uint32_t n, uint32_t i)
{
    return ((const uint32_t *)rows)[row * n + i];
}

/* True when the front of the hit triangle looks along the ray, that is towards its end. */
static inline bool faces_end(const struct RTCFilterFunctionNArguments *args, uint32_t i)
{
    uint32_t n = args->N;
    return float_at(args->hit, HIT_NG_X, n, i) * float_at(args->ray, RAY_DIR_X, n, i) +
               float_at(args->hit, HIT_NG_Y, n, i) * float_at(args->ray, RAY_DIR_Y, n, i) +
               float_at(args->hit, HIT_NG_Z, n, i) * float_at(args->ray, RAY_DIR_Z, n, i) >
           0;
}

static inline void filter_facing(const struct RTCFilterFunctionNArguments *args, bool end)
{
    for (uint32_t i = 0; i < args->N; i++)
        if (args->valid[i] == -1 && faces_end(args, i) != end)
            args->valid[i] = 0;
}

/* What is left of the light of the shadow ray that is called `id`, behind a surface. Embree asks
 * once about a ray and a triangle, since its hierarchies of medium quality refer to each once. */
static bool dims_to_nothing(struct trace_context *context, uint32_t id, float alpha, float distance)
{
    if (alpha > 0)
        context->nearest[id] = fminf(context->nearest[id], distance);
    context->share[id] *= 1 - fminf(fmaxf(alpha, 0), 1);
    if (context->share[id] >= TRACE_LEAST_SHARE)
        return false;
    context->share[id] = 0;
    return true;
}

static inline void filter_alpha(const struct RTCFilterFunctionNArguments *args, bool end)
{
    const struct trace_filter *filter = args->geometryUserPtr;
    const struct trace_alpha *alpha = filter->alpha;
    uint32_t n = args->N;
    for (uint32_t i = 0; i < n; i++) {
        if (args->valid[i] != -1)
            continue;
        uint32_t primitive = uint_at(args->hit, HIT_PRIMITIVE, n, i);
        if (filter->triangles)
            primitive = filter->triangles[primitive];
        const struct trace_alpha_material *m = &alpha->table[alpha->materials[primitive]];
        bool counts = m->two_sided || filter->both_sides || faces_end(args, i) == end;
        if (counts) {
            uint32_t id = uint_at(args->ray, RAY_ID, n, i);
            float a = trace_alpha_at(alpha, primitive, float_at(args->hit, HIT_U, n, i),
                float_at(args->hit, HIT_V, n, i));
            if (m->blend && end)
                counts = dims_to_nothing((struct trace_context *)args->context, id, a,
                    float_at(args->ray, RAY_FAR, n, i));
            else if (m->blend) /* a share alpha of the eye's rays see it */
                counts =
                    a >= ((float)(trace_hash(id + primitive * 0x9e3779b9u) >> 8) + 0.5f) * 0x1p-24f;
            else
                counts = a >= m->cutoff;
        }
        if (!counts)
            args->valid[i] = 0;
    }
}

void trace_filter_facing_shadow(const struct RTCFilterFunctionNArguments *args)
{
    filter_facing(args, true);
}

void trace_filter_facing_primary(const struct RTCFilterFunctionNArguments *args)
{
    filter_facing(args, false);
}

void trace_filter_alpha_shadow(const struct RTCFilterFunctionNArguments *args)
{
    filter_alpha(args, true);
}

void trace_filter_alpha_primary(const struct RTCFilterFunctionNArguments *args)
{
    filter_alpha(args, false);
}
