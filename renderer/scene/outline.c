#include "renderer/scene/outline.h"
#include "protocol/srgb.h"
#include "renderer/blob/check.h"
#include <math.h>
#include <string.h>

/* Vertices per primitive beyond which only some are looked at; the error is that of one skipped
 * vertex, which at these counts is far below a pixel. */
#define MOST_VERTICES 200000u
#define MOST_TRIANGLES 100000u
/* And of all instances together. */
#define MOST_PLACED 2000000u

static void place(const struct psc_instance *instance, const float p[3], float world[3])
{
    const float *m = instance->world;
    for (int r = 0; r < 3; r++)
        world[r] = m[4 * r] * p[0] + m[4 * r + 1] * p[1] + m[4 * r + 2] * p[2] + m[4 * r + 3];
}

static bool is_inside(const float p[3], const float (*content)[3])
{
    for (int k = 0; k < 3; k++) {
        float slack = 1e-3f * (content[1][k] - content[0][k]) + 1e-6f * fabsf(content[1][k]);
        if (p[k] < content[0][k] - slack || p[k] > content[1][k] + slack)
            return false;
    }
    return true;
}

/* Directions on a spherical Fibonacci lattice (Swinbank and Purser 2006). */
static void direction(uint32_t i, float d[3])
{
    float z = 1 - (2 * (float)i + 1) / OUTLINE_DIRECTIONS, r = sqrtf(1 - z * z);
    float turn = 2.39996323f * (float)i;
    d[0] = r * cosf(turn), d[1] = z, d[2] = r * sinf(turn);
}

void outline_grow(
    struct outline *o, const struct psc_scene *s, const float (*content)[3], const float shift[3])
{
    float directions[OUTLINE_DIRECTIONS][3];
    bool any = o->extreme_count > 0;
    for (uint32_t i = 0; i < OUTLINE_DIRECTIONS; i++) {
        direction(i, directions[i]);
        if (!any)
            o->along[i] = -INFINITY;
    }
    uint64_t placed = 0;
    for (uint32_t n = 0; n < s->instance_count; n++)
        placed += s->primitives[s->instances[n].primitive].vertex_count;
    uint32_t step = s->vertex_count / MOST_VERTICES + 1;
    uint64_t apart = placed / step / MOST_PLACED * step + step;
    for (uint32_t n = 0; n < s->instance_count; n++) {
        const struct psc_primitive *p = &s->primitives[s->instances[n].primitive];
        /* Of each instance others, where few are looked at. */
        uint64_t first =
            apart > step && p->vertex_count ? n * 7919ull % p->vertex_count % apart : 0;
        for (uint64_t v = first; v < p->vertex_count; v += apart) {
            float at[3];
            place(&s->instances[n], s->positions[p->first_vertex + v], at);
            if (!is_inside(at, content))
                continue;
            any = true;
            for (int k = 0; k < 3; k++)
                at[k] += shift[k];
            for (uint32_t i = 0; i < OUTLINE_DIRECTIONS; i++) {
                const float *d = directions[i];
                float along = at[0] * d[0] + at[1] * d[1] + at[2] * d[2];
                if (along > o->along[i]) {
                    o->along[i] = along;
                    memcpy(o->extremes[i], at, sizeof at);
                }
            }
        }
    }
    o->extreme_count = any ? OUTLINE_DIRECTIONS : 0;
}

static float area_normal(const struct psc_scene *s, const struct psc_instance *instance,
    uint32_t first_index, float center[3], float normal[3])
{
    float corner[3][3], a[3], b[3];
    for (int k = 0; k < 3; k++)
        place(instance, s->positions[s->indices[first_index + k]], corner[k]);
    for (int k = 0; k < 3; k++) {
        a[k] = corner[1][k] - corner[0][k], b[k] = corner[2][k] - corner[0][k];
        center[k] = (corner[0][k] + corner[1][k] + corner[2][k]) / 3;
    }
    for (int k = 0; k < 3; k++)
        normal[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
    float twice = sqrtf(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    float side = instance->flags & PSC_MIRRORED ? -1 : 1;
    for (int k = 0; k < 3; k++)
        normal[k] *= side / fmaxf(twice, 1e-30f);
    return 0.5f * twice;
}

/* Of a colour under a texture of which the last level is the mean, as near as 8 bits have it. */
static float brightest(
    const struct psc_scene *s, const float color[3], const struct psc_texture_ref *map)
{
    float most = 0;
    const uint8_t *texel = NULL;
    if (map->texture >= 0) {
        const struct psc_image *image = &s->images[s->textures[map->texture].image];
        texel = s->texels + image->first_byte + mip_chain_bytes(image->width, image->height) - 4;
    }
    for (int k = 0; k < 3; k++)
        most = fmaxf(most, color[k] * (texel ? pen_srgb_decodef(texel[k] / 255.0f) : 1));
    return most;
}

/* Walks over (some of) the triangles inside. With `samples`, takes one whenever another `stride` of
 * area has gone by; returns the area. */
static double walk(struct outline_samples *o, const struct psc_scene *s, const float (*content)[3],
    bool take, double stride)
{
    uint64_t step = s->header->triangles / MOST_TRIANGLES + 1, at = 0;
    double area = 0, next = 0.5 * stride;
    for (uint32_t n = 0; n < s->instance_count; n++) {
        const struct psc_primitive *p = &s->primitives[s->instances[n].primitive];
        uint64_t triangles = p->index_count / 3;
        const struct psc_material *m = &s->materials[p->material];
        float glow = take ? brightest(s, m->emissive, &m->emission) : 0;
        float albedo = take ? brightest(s, m->base_color, &m->base) : 0;
        for (uint64_t i = (step - at % step) % step; i < triangles; i += step) {
            float center[3], normal[3];
            float one =
                area_normal(s, &s->instances[n], p->first_index + 3 * (uint32_t)i, center, normal);
            if (!is_inside(center, content))
                continue;
            area += one;
            for (; take && next < area && o->count < OUTLINE_SAMPLES; next += stride) {
                memcpy(o->at[o->count].point, center, sizeof center);
                memcpy(o->at[o->count].normal, normal, sizeof normal);
                o->at[o->count].glow = glow;
                o->at[o->count].albedo = albedo;
                o->at[o->count++].one_sided = !(m->flags & (uint32_t)PSC_DOUBLE_SIDED);
            }
        }
        at += triangles;
    }
    return area;
}

void outline_sample(struct outline_samples *samples, const struct psc_scene *scene,
    const float (*content)[3], const float shift[3])
{
    samples->count = 0;
    double area = walk(samples, scene, content, false, 0);
    if (area > 0)
        walk(samples, scene, content, true, area / OUTLINE_SAMPLES);
    for (uint32_t i = 0; i < samples->count; i++)
        for (int k = 0; k < 3; k++)
            samples->at[i].point[k] += shift[k];
}
