/* Where a scene is, and how large. */
#include "protocol/memory.h"
#include "protocol/number.h"
#include "renderer/blob/bounds.h"
#include "renderer/scene/scene.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

float scene_floor(const struct scene *s)
{
    const float now = s->blob.header->bounds_min[1];
    const struct psc_header *rest = s->file.header;
    bool empty = !(rest->bounds_min[1] <= rest->bounds_max[1]);
    return empty ? now : fminf(now, rest->bounds_min[1]);
}

bool scene_is_empty(const struct scene *s)
{
    return !(s->blob.header->bounds_min[0] <= s->blob.header->bounds_max[0]);
}

float scene_radius(const struct scene *s)
{
    if (scene_is_empty(s))
        return 1;
    float sum = 0;
    for (int i = 0; i < 3; i++) {
        float d = s->content[1][i] - s->content[0][i];
        sum += d * d;
    }
    return fmaxf(0.5f * sqrtf(sum), 1e-9f);
}

void scene_center(const struct scene *s, float center[3])
{
    for (int i = 0; i < 3; i++)
        center[i] = scene_is_empty(s) ? 0 : 0.5f * (s->content[0][i] + s->content[1][i]);
}

void scene_point_in(const struct scene *s, const double world[3], float point[3])
{
    for (int i = 0; i < 3; i++)
        point[i] = (float)(world[i] - s->blob.header->origin[i]);
}

void scene_point_out(const struct scene *s, const float point[3], double world[3])
{
    for (int i = 0; i < 3; i++)
        world[i] = s->blob.header->origin[i] + pen_widen(point[i]);
}

void scene_direction(const double from[3], const double to[3], float direction[3])
{
    double d[3], size = 0;
    for (int i = 0; i < 3; i++) {
        d[i] = to[i] - from[i];
        size = fmax(size, fabs(d[i]));
    }
    for (int i = 0; i < 3; i++)
        direction[i] = size > 0 ? (float)ldexp(d[i], -ilogb(size)) : 0;
}

/* Vertices transformed for tight bounds, per scene: a few milliseconds' worth. */
#define BOUND_BUDGET (8u << 20)

static void bound_instances(struct scene *s)
{
    uint64_t left = BOUND_BUDGET;
    free(s->instance_bounds);
    s->instance_bounds = pen_alloc_zero(s->blob.instance_count, sizeof *s->instance_bounds);
    for (uint32_t i = 0; i < s->blob.instance_count; i++) {
        uint32_t vertices = s->blob.primitives[s->blob.instances[i].primitive].vertex_count;
        float(*bounds)[3] = s->instance_bounds[i];
        bool tight = vertices <= left;
        left -= tight ? vertices : 0;
        psc_bounds_clear(bounds[0], bounds[1]);
        psc_bounds_grow(&s->blob, i, tight, bounds[0], bounds[1]);
    }
}

void scene_instance_bounds(const struct scene *s, uint32_t instance, float min[3], float max[3])
{
    memcpy(min, s->instance_bounds[instance][0], 12);
    memcpy(max, s->instance_bounds[instance][1], 12);
}

static void find_content(struct scene *s)
{
    const struct psc_header *h = s->blob.header;
    float flat = 1e-4f * (h->bounds_max[1] - h->bounds_min[1]);
    bool any = false;
    for (uint32_t i = 0; i < s->blob.instance_count; i++) {
        float min[3], max[3];
        scene_instance_bounds(s, i, min, max);
        if (max[1] <= h->bounds_min[1] + flat)
            continue; /* a floor at the very bottom */
        for (int k = 0; k < 3; k++) {
            s->content[0][k] = any ? fminf(s->content[0][k], min[k]) : min[k];
            s->content[1][k] = any ? fmaxf(s->content[1][k], max[k]) : max[k];
        }
        any = true;
    }
    if (any) {
        s->content[0][1] = h->bounds_min[1]; /* it stands on that floor */
        return;
    }
    memcpy(s->content[0], h->bounds_min, sizeof s->content[0]);
    memcpy(s->content[1], h->bounds_max, sizeof s->content[1]);
}

void scene_measure(struct scene *s)
{
    bound_instances(s);
    find_content(s);
    outline_make(&s->outline, &s->blob, (const float(*)[3])s->content);
}
