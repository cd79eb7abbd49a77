#include "renderer/scene/content.h"
#include "protocol/memory.h"
#include "renderer/blob/bounds.h"
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define NONE UINT32_MAX
#define MOST_SETTINGS 4
#define SETTING_SIZE 8 /* of the rest, at least */
#define SLAB_HEIGHT 50 /* times less high than wide */
#define SPECKS 20      /* all extents together make so little of the whole */
#define LOOKED_AT 512u /* triangles of a shell */

struct finding {
    const struct psc_scene *scene;
    const float (*bounds)[2][3];
    bool *left_out; /* by instance */
};

static void merge(float to[2][3], const float box[2][3])
{
    for (int k = 0; k < 3; k++) {
        to[0][k] = fminf(to[0][k], box[0][k]);
        to[1][k] = fmaxf(to[1][k], box[1][k]);
    }
}

static bool is_empty(const float box[2][3])
{
    return !(box[0][0] <= box[1][0]);
}

static float diagonal(const float box[2][3])
{
    float sum = 0;
    for (int k = 0; k < 3; k++)
        sum += (box[1][k] - box[0][k]) * (box[1][k] - box[0][k]);
    return sqrtf(sum);
}

static void bound_rest(const struct finding *f, float box[2][3])
{
    psc_bounds_clear(box[0], box[1]);
    for (uint32_t i = 0; i < f->scene->instance_count; i++)
        if (!f->left_out[i])
            merge(box, f->bounds[i]);
}

static uint32_t largest(const struct finding *f)
{
    uint32_t found = NONE;
    float most = -1;
    for (uint32_t i = 0; i < f->scene->instance_count; i++) {
        float size = f->left_out[i] || is_empty(f->bounds[i]) ? -1 : diagonal(f->bounds[i]);
        if (size > most)
            most = size, found = i;
    }
    return found;
}

static bool is_within(const float inner[2][3], const float outer[2][3], int axis)
{
    return inner[0][axis] >= outer[0][axis] && inner[1][axis] <= outer[1][axis];
}

static bool is_slab_below(const float slab[2][3], const float rest[2][3])
{
    float height = slab[1][1] - slab[0][1];
    float wide = fminf(slab[1][0] - slab[0][0], slab[1][2] - slab[0][2]);
    return height * SLAB_HEIGHT <= wide && is_within(rest, slab, 0) && is_within(rest, slab, 2) &&
           rest[0][1] >= slab[0][1] && rest[1][1] > slab[1][1];
}

/* Most of a primitive's fronts, or of both sides of one that shines by itself, face its middle. */
static bool faces_inwards(const struct psc_scene *s, const struct psc_instance *instance)
{
    const struct psc_primitive *p = &s->primitives[instance->primitive];
    const struct psc_material *m = &s->materials[p->material];
    if (m->flags & PSC_DOUBLE_SIDED)
        return (m->flags & PSC_UNLIT) || m->emissive[0] + m->emissive[1] + m->emissive[2] > 0;
    uint32_t triangles = p->index_count / 3, step = triangles / LOOKED_AT + 1;
    int inwards = 0;
    for (uint32_t i = 0; i < triangles; i += step) {
        const uint32_t *t = s->indices + p->first_index + 3 * (size_t)i;
        double n[3], towards = 0;
        if (!psc_triangle_normal(s->positions[t[0]], s->positions[t[1]], s->positions[t[2]], n))
            continue;
        for (int k = 0; k < 3; k++)
            towards += n[k] * (0.5 * (p->bounds_min[k] + p->bounds_max[k]) - s->positions[t[0]][k]);
        inwards += towards > 0 ? 1 : -1;
    }
    return inwards > 0;
}

enum setting { NO_SETTING, SLAB, SKY };

static enum setting setting_of(const struct finding *f, uint32_t instance, const float (*rest)[3])
{
    const float(*box)[3] = f->bounds[instance];
    bool around = true;
    if (diagonal(box) < SETTING_SIZE * diagonal(rest))
        return NO_SETTING;
    for (int k = 0; k < 3; k++)
        around = around && is_within(rest, box, k);
    if (around && faces_inwards(f->scene, &f->scene->instances[instance]))
        return SKY;
    return is_slab_below(box, rest) ? SLAB : NO_SETTING;
}

struct settings {
    uint32_t count, instances[MOST_SETTINGS];
    enum setting kinds[MOST_SETTINGS];
};

/* Leaves out as many of the largest as are settings of all the rest. */
static void leave_out_settings(struct finding *f, struct settings *found)
{
    float rest[2][3];
    uint32_t one;
    found->count = 0;
    while (found->count < MOST_SETTINGS && (one = largest(f)) != NONE) {
        f->left_out[one] = true;
        found->instances[found->count++] = one;
    }
    for (bool all = false; found->count && !all;) {
        bound_rest(f, rest);
        all = !is_empty((const float(*)[3])rest);
        for (uint32_t i = 0; all && i < found->count; i++) {
            found->kinds[i] = setting_of(f, found->instances[i], (const float(*)[3])rest);
            all = found->kinds[i] != NO_SETTING;
        }
        if (!all) /* the smallest of them belongs to the rest */
            f->left_out[found->instances[--found->count]] = false;
    }
}

static bool is_near(const float a[2][3], const float b[2][3], float distance)
{
    for (int k = 0; k < 3; k++)
        if (a[0][k] > b[1][k] + distance || b[0][k] > a[1][k] + distance)
            return false;
    return true;
}

/* Around the largest of specks that a picture of all of them would not show; false: it would. */
static bool choose_cluster(const struct finding *f, float box[2][3])
{
    float extents = 0;
    uint32_t start = largest(f);
    for (uint32_t i = 0; i < f->scene->instance_count; i++)
        extents += f->left_out[i] || is_empty(f->bounds[i]) ? 0 : diagonal(f->bounds[i]);
    if (start == NONE || !(extents * SPECKS < diagonal((const float(*)[3])box)) ||
        !(diagonal(f->bounds[start]) > 0))
        return false;
    memcpy(box, f->bounds[start], 2 * sizeof *box);
    for (float before = 0; before < diagonal((const float(*)[3])box);) {
        before = diagonal((const float(*)[3])box);
        for (uint32_t i = 0; i < f->scene->instance_count; i++)
            if (!f->left_out[i] && is_near(f->bounds[i], (const float(*)[3])box, before))
                merge(box, f->bounds[i]);
    }
    return true;
}

void content_find(const struct psc_scene *scene, const float (*instance_bounds)[2][3], float ground,
    struct content *content)
{
    const struct psc_header *h = scene->header;
    struct finding f = {
        scene, instance_bounds, pen_alloc_zero(scene->instance_count, sizeof *f.left_out)};
    float flat = 1e-4f * (h->bounds_max[1] - h->bounds_min[1]);
    float bottom = fmaxf(h->bounds_min[1], ground) + flat, lowest = INFINITY;
    float box[2][3];
    bool sky = false, slab = false;
    struct settings settings;
    for (uint32_t i = 0; i < scene->instance_count; i++)
        f.left_out[i] = !(instance_bounds[i][1][1] > bottom);
    leave_out_settings(&f, &settings);
    for (uint32_t i = 0; i < settings.count; i++) {
        sky |= settings.kinds[i] == SKY;
        slab |= settings.kinds[i] == SLAB;
        if (settings.kinds[i] == SLAB)
            lowest = fminf(lowest, instance_bounds[settings.instances[i]][0][1]);
    }
    bound_rest(&f, box);
    bool any = !is_empty((const float(*)[3])box);
    bool specks = any && choose_cluster(&f, box);
    content->apart = sky || specks;
    content->floor = content->apart ? fminf(lowest, box[0][1]) : h->bounds_min[1];
    if (any && !slab && !content->apart)
        box[0][1] = h->bounds_min[1]; /* it stands on that floor */
    for (int k = 0; !any && k < 3; k++)
        box[0][k] = h->bounds_min[k], box[1][k] = h->bounds_max[k];
    memcpy(content->box, box, sizeof box);
    free(f.left_out);
}
