#include "renderer/passes/light/sample_maps.h"
#include "protocol/fnv.h"
#include "renderer/passes/draw/passes.h"
#include "renderer/passes/draw/pieces.h"
#include "renderer/passes/draw/turn.h"
#include "renderer/passes/map/depth_map.h"
#include "renderer/passes/map/shadow_cache.h"
#include "renderer/trace/points.h"
#include <assert.h>
#include <math.h>
#include <string.h>

#define AT_ONCE 8 /* maps that a GPU draws between two looks at the time */

static float radical_inverse(uint32_t i)
{
    float value = 0, scale = 0.5f;
    for (; i; i >>= 1, scale *= 0.5f)
        value += scale * (float)(i & 1);
    return value;
}

static void to_disk(float uv[2])
{
    float a = uv[0], b = uv[1], r, t;
    if (a == 0 && b == 0)
        return;
    if (fabsf(a) > fabsf(b))
        r = a, t = 0.25f * (float)M_PI * (b / a);
    else
        r = b, t = 0.5f * (float)M_PI - 0.25f * (float)M_PI * (a / b);
    uv[0] = r * cosf(t), uv[1] = r * sinf(t);
}

struct sample_point sample_point_at(const struct light_face *face, float u, float v)
{
    struct sample_point point = {.uv = {u, v}};
    if (face->shape == SHAPE_DISK)
        to_disk(point.uv);
    for (int k = 0; k < 2; k++)
        point.at[k] = point.uv[k] * face->extent[k];
    return point;
}

void sample_points(const struct light_face *face, uint32_t count, struct sample_point *points)
{
    for (uint32_t i = 0; i < count; i++)
        points[i] = sample_point_at(face, 2 * ((float)i + 0.5f) / (float)count - 1,
            2 * (radical_inverse(i) + 0.5f / (float)count) - 1);
}

/* Of 400 scrambles the one that comes nearest to the areas that 4000 straight edges and corners cut
 * off, after 16, 64 and 256 points: edges as well as the Hammersley set, corners better. */
#define SEQUENCE_SEED 353u

void sample_sequence(
    const struct light_face *face, uint32_t first, uint32_t count, struct sample_point *points)
{
    for (uint32_t i = 0; i < count; i++) {
        uint32_t x, y;
        trace_sample_at(first + i, SEQUENCE_SEED, &x, &y);
        points[i] = sample_point_at(face, (float)x * 0x1p-31f - 1, (float)y * 0x1p-31f - 1);
    }
}

struct sample_map sample_map_entry(
    const struct sample_point *point, const float rect[4], uint32_t layer)
{
    struct sample_map entry = {.layer = {(float)layer}};
    for (int k = 0; k < 2; k++) {
        entry.at[k] = point->at[k];
        entry.at[2 + k] = point->uv[k];
        entry.window[k] = 1 / (rect[2 + k] - rect[k]);
        entry.window[2 + k] = -rect[k] * entry.window[k];
    }
    return entry;
}

bool pass_sample_views(struct technique_run *run, const struct sample_view *views, uint32_t count,
    const struct gl_texture *array, struct pen_error *error)
{
    GLuint framebuffer;
    bool ok = true;
    gl_timer_begin(&run->ctx->timer, PEN_STAGE_SHADOW, "sample maps");
    gl.CreateFramebuffers(1, &framebuffer);
    for (uint32_t i = 0; ok && i < count; i++) {
        const struct sample_view *view = &views[i];
        gl.NamedFramebufferTextureLayer(
            framebuffer, GL_DEPTH_ATTACHMENT, array->name, 0, (GLint)view->layer);
        ok = pass_draw_casters(
            run, framebuffer, array->width, view->point.at, view->rect, false, error);
        if (ok && (run->ctx->software || i % AT_ONCE == AT_ONCE - 1))
            ok = pass_turn(run->ctx, error);
    }
    gl.DeleteFramebuffers(1, &framebuffer);
    gl_timer_end(&run->ctx->timer);
    return ok && pass_turn(run->ctx, error);
}

/* Those layers of an array of points[0 .. count) whose bit is set. */
static bool draw_layers(struct technique_run *run, const struct sample_point *points,
    uint32_t count, uint32_t wanted, const struct gl_texture *array, struct pen_error *error)
{
    struct sample_view views[SAMPLE_MAP_BATCH];
    uint32_t n = 0;
    assert(count <= SAMPLE_MAP_BATCH);
    for (uint32_t i = 0; i < count; i++) {
        if (!(wanted >> i & 1))
            continue;
        views[n].point = points[i];
        views[n].layer = i;
        light_face_window(run->face, run->light->casters, points[i].at, views[n].rect);
        n++;
    }
    return pass_sample_views(run, views, n, array, error);
}

/* The builder of a kept input only gets the run: what it builds is handed over here, and taken before
 * another frame may come in between. One GL thread per process, so a static is no shared state. */
static struct pending {
    const struct sample_point *points;
    uint32_t count;
} pending;

static uint64_t map_bytes(uint32_t size, uint32_t count)
{
    return (uint64_t)size * size * 4 * count;
}

static bool allocate(struct technique_run *run, const struct shadow_key *key,
    struct shadow_input *input, struct pen_error *error)
{
    uint32_t count = pending.count;
    if (!pass_room(run->ctx, map_bytes(key->size, count), error))
        return false;
    input->textures[0] = gl_texture_create(GL_DEPTH_COMPONENT32F, key->size, key->size, count, 1);
    return true;
}

static bool build(struct technique_run *run, const struct shadow_key *key,
    struct shadow_input *input, struct pen_error *error)
{
    struct pending own = pending;
    return allocate(run, key, input, error) && pass_turn(run->ctx, error) &&
           draw_layers(run, own.points, own.count, ~0u, &input->textures[0], error);
}

static const struct shadow_input *get(struct technique_run *run, const char *kind,
    const struct sample_point *points, uint32_t count, uint32_t size, shadow_build build_input,
    struct pen_error *error)
{
    struct shadow_key key = {.kind = kind, .size = size, .extra = {count}};
    uint64_t hash = PEN_FNV_START;
    for (uint32_t i = 0; i < count; i++)
        hash = pen_fnv(hash, points[i].at, sizeof points[i].at);
    memcpy(&key.extra[1], &hash, sizeof hash);
    pending.points = points;
    pending.count = count;
    return shadow_cache_get(run, &key, build_input, error);
}

bool pass_sample_maps(struct technique_run *run, const struct sample_point *points, uint32_t count,
    uint32_t size, bool keep, struct sample_map *table, const struct gl_texture **maps,
    struct pen_error *error)
{
    for (uint32_t i = 0; i < count; i++) {
        float rect[4];
        light_face_window(run->face, run->light->casters, points[i].at, rect);
        table[i] = sample_map_entry(&points[i], rect, i);
    }
    run->result->shadow_maps += count;
    if (keep) {
        const struct shadow_input *input =
            get(run, "sample maps", points, count, size, build, error);
        *maps = input ? &input->textures[0] : NULL;
        return input != NULL;
    }
    static const struct pass_targets scratch = {1};
    struct gl_target *array = pass_targets(run->ctx, &scratch);
    if (array->texture.width != size) {
        gl_target_destroy(array); /* not the old one and the new one together */
        if (!pass_room(run->ctx, map_bytes(size, SAMPLE_MAP_BATCH), error))
            return false;
    }
    if ((gl_target_fit(array, GL_DEPTH_COMPONENT32F, size, size, SAMPLE_MAP_BATCH, 1) &&
            !pass_turn(run->ctx, error)))
        return false;
    *maps = &array->texture;
    return draw_layers(run, points, count, ~0u, *maps, error);
}

const struct gl_texture *pass_sample_page(struct technique_run *run,
    const struct sample_point *points, uint32_t count, uint32_t size, uint32_t wanted,
    struct pen_error *error)
{
    const struct shadow_input *input =
        get(run, "sample page", points, count, size, allocate, error);
    if (!input)
        return NULL;
    /* The cache owns the input; which of its layers are drawn is the page's own business. */
    float *drawn = ((struct shadow_input *)input)->values;
    uint32_t missing = 0;
    for (uint32_t i = 0; i < count; i++)
        if ((wanted >> i & 1) && drawn[i] == 0)
            missing |= 1u << i;
    if (!missing)
        return &input->textures[0];
    shadow_cache_mark_built(run->ctx);
    if (!draw_layers(run, points, count, missing, &input->textures[0], error))
        return NULL;
    for (uint32_t i = 0; i < count; i++)
        if (missing >> i & 1)
            drawn[i] = 1;
    return &input->textures[0];
}
