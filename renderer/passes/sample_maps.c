#include "renderer/passes/sample_maps.h"
#include <math.h>
#include <string.h>

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

void sample_points(const struct light_face *face, uint32_t count, struct sample_point *points)
{
    for (uint32_t i = 0; i < count; i++) {
        float *uv = points[i].uv;
        uv[0] = 2 * ((float)i + 0.5f) / (float)count - 1;
        uv[1] = 2 * (radical_inverse(i) + 0.5f / (float)count) - 1;
        if (face->shape == LIGHT_DISK)
            to_disk(uv);
        for (int k = 0; k < 2; k++)
            points[i].at[k] = uv[k] * face->half[k];
    }
}

static bool draw_layers(struct technique_run *run, const struct sample_point *points,
    uint32_t count, const struct gl_texture *array, struct pen_error *error)
{
    GLuint framebuffer;
    bool ok = true;
    gl_timer_begin(&run->ctx->timer, PEN_STAGE_SHADOW, "sample maps");
    gl.CreateFramebuffers(1, &framebuffer);
    for (uint32_t i = 0; ok && i < count; i++) {
        float rect[4];
        light_face_window(run->face, run->light->casters, points[i].at, rect);
        gl.NamedFramebufferTextureLayer(framebuffer, GL_DEPTH_ATTACHMENT, array->name, 0, (GLint)i);
        ok = pass_draw_casters(run, framebuffer, array->width, points[i].at, rect, false, error);
    }
    gl.DeleteFramebuffers(1, &framebuffer);
    gl_timer_end(&run->ctx->timer);
    return ok;
}

struct batch {
    const struct sample_point *points;
    uint32_t count;
};
/* The builder of a kept input only gets the run: what it builds is handed over here. One GL thread
 * per process, so a static is no shared state. */
static struct batch pending;

static bool build(struct technique_run *run, const struct shadow_key *key,
    struct shadow_input *input, struct pen_error *error)
{
    input->textures[0] =
        gl_texture_create(GL_DEPTH_COMPONENT32F, key->size, key->size, pending.count, 1);
    return draw_layers(run, pending.points, pending.count, &input->textures[0], error);
}

bool pass_sample_maps(struct technique_run *run, const struct sample_point *points, uint32_t count,
    uint32_t size, uint32_t number, bool keep, struct sample_map *table,
    const struct gl_texture **maps, struct pen_error *error)
{
    memset(table, 0, count * sizeof *table);
    for (uint32_t i = 0; i < count; i++) {
        float rect[4];
        light_face_window(run->face, run->light->casters, points[i].at, rect);
        for (int k = 0; k < 2; k++) {
            table[i].at[k] = points[i].at[k];
            table[i].at[2 + k] = points[i].uv[k];
            table[i].window[k] = 1 / (rect[2 + k] - rect[k]);
            table[i].window[2 + k] = -rect[k] * table[i].window[k];
        }
    }
    if (keep) {
        struct shadow_key key = {.kind = "sample maps", .size = size, .extra = {number, count}};
        memcpy(&key.extra[2], points[0].at, 8);
        memcpy(&key.extra[4], points[count - 1].at, 8);
        pending = (struct batch){points, count};
        const struct shadow_input *input = shadow_cache_get(run, &key, build, error);
        *maps = input ? &input->textures[0] : NULL;
        return input != NULL;
    }
    struct gl_texture *scratch = &run->ctx->sample_scratch;
    gl_texture_fit(scratch, GL_DEPTH_COMPONENT32F, size, size, SAMPLE_MAP_BATCH, 1);
    *maps = scratch;
    return draw_layers(run, points, count, scratch, error);
}
