#include "renderer/light/casters.h"
#include "renderer/blob/bounds.h"
#include <cglm/cglm.h>
#include <string.h>

#define SHOWN 1.0f          /* px across: what is smaller receives no shadow that is seen */
#define MOST_CORNERS 60000u /* that are looked at one by one: half a millisecond */
#define SMALL 0.25f /* of all that casts, across: so much less is worth maps that follow the view */

static float size_of(const float box[2][3])
{
    float size[3];
    glm_vec3_sub((float *)box[1], (float *)box[0], size);
    return glm_vec3_norm(size);
}

/* It reaches to the far side of the bounds along an axis. */
static bool is_far_side(const struct scene *scene, int k, const float box[2][3],
    const struct caster_light *light, float flat)
{
    const struct psc_header *h = scene->blob.header;
    const float *sun = light->sun, *at = light->origin;
    bool light_above = sun ? sun[k] < 0 : at[k] > box[1][k];
    bool light_below = sun ? sun[k] > 0 : at[k] < box[0][k];
    return (light_above && box[0][k] <= h->bounds_min[k] + flat) ||
           (light_below && box[1][k] >= h->bounds_max[k] - flat);
}

static bool is_backdrop(
    const struct scene *scene, const float box[2][3], const struct caster_light *light, float flat)
{
    for (int k = 0; k < 3; k++)
        if (box[1][k] - box[0][k] <= flat && is_far_side(scene, k, box, light, flat))
            return true;
    return false;
}

bool casters_is_backdrop(const struct scene *scene, const float min[3], const float max[3],
    const struct caster_light *light)
{
    const float box[2][3] = {{min[0], min[1], min[2]}, {max[0], max[1], max[2]}};
    return is_backdrop(scene, box, light, 1e-5f * scene_radius(scene));
}

static void grow(float bounds[2][3], const float box[2][3])
{
    for (int k = 0; k < 3; k++) {
        bounds[0][k] = fminf(bounds[0][k], box[0][k]);
        bounds[1][k] = fmaxf(bounds[1][k], box[1][k]);
    }
}

bool casters_overlap(const float a[2][3], const float b[2][3])
{
    for (int k = 0; k < 3; k++)
        if (a[0][k] > b[1][k] || a[1][k] < b[0][k])
            return false;
    return true;
}

/* Not beside the picture, and large enough in it. */
static bool is_shown(const struct view *view, const float box[2][3])
{
    vec4 clip[8];
    float nearest = INFINITY;
    for (int i = 0; i < 8; i++) {
        vec4 corner = {box[i & 1][0], box[i >> 1 & 1][1], box[i >> 2][2], 1};
        glm_mat4_mulv((vec4 *)view->world_to_clip, corner, clip[i]);
        nearest = fminf(nearest, clip[i][3]);
    }
    for (int side = 0; side < 5; side++) {
        int outside = 0;
        for (int i = 0; i < 8; i++) {
            float w = clip[i][3], at = side < 4 ? clip[i][side / 2] : 0;
            outside += side == 4 ? w < 0 : side & 1 ? at > w : at < -w;
        }
        if (outside == 8)
            return false;
    }
    float pixel = 2 * tanf(0.5f * view->fov_y_rad) / (float)view->height; /* at distance 1 */
    return !(size_of(box) < SHOWN * pixel * nearest);
}

/* Of what the picture shows: all that may receive. */
static void shown_bounds(
    const struct scene *scene, const struct view *view, bool ground, float shown[2][3])
{
    psc_bounds_clear(shown[0], shown[1]);
    for (uint32_t i = 0; i < scene->blob.instance_count; i++)
        if (is_shown(view, (const float(*)[3])scene->instance_bounds[i]))
            grow(shown, (const float(*)[3])scene->instance_bounds[i]);
    if (!ground)
        return;
    float g[4];
    scene_ground(scene, g);
    const float square[2][3] = {
        {g[0] - g[3], g[1], g[2] - g[3]}, {g[0] + g[3], scene_ground_top(scene), g[2] + g[3]}};
    grow(shown, square);
}

/* A box as the sun sees it: two coordinates across its light and one along. */
static void along_sun(const struct caster_light *light, const float box[2][3], float seen[2][3])
{
    const float *axes[3] = {light->across[0], light->across[1], light->sun};
    psc_bounds_clear(seen[0], seen[1]);
    for (int i = 0; i < 8; i++) {
        float corner[3] = {box[i & 1][0], box[i >> 1 & 1][1], box[i >> 2][2]}, at[2][3];
        for (int k = 0; k < 3; k++)
            at[0][k] = at[1][k] = glm_vec3_dot(corner, (float *)axes[k]);
        grow(seen, (const float(*)[3])at);
    }
}

/* A box between the light and what is shown, or around it; too many rather than too few. */
static bool may_cast(
    const struct caster_light *light, const float shown[2][3], const float box[2][3])
{
    float from[2][3], to[2][3];
    if (light->sun) {
        along_sun(light, box, from);
        along_sun(light, shown, to);
        float wider = light->extent * fmaxf(to[1][2] - from[0][2], 0);
        for (int k = 0; k < 2; k++)
            to[0][k] -= wider, to[1][k] += wider;
        to[0][2] = -INFINITY;
        return casters_overlap((const float(*)[3])from, (const float(*)[3])to);
    }
    for (int k = 0; k < 3; k++) {
        to[0][k] = light->origin[k] - light->extent;
        to[1][k] = light->origin[k] + light->extent;
    }
    grow(to, shown);
    return casters_overlap(box, (const float(*)[3])to);
}

/* Of what of an instance casts: a floor may be a part of it. */
static void instance_casters(const struct scene *scene, uint32_t number,
    const struct caster_light *light, uint32_t *left, float casters[2][3])
{
    const struct psc_scene *blob = &scene->blob;
    const struct psc_instance *instance = &blob->instances[number];
    const struct psc_primitive *p = &blob->primitives[instance->primitive];
    const float(*box)[3] = (const float(*)[3])scene->instance_bounds[number];
    /* What coordinates are rounded to: something small may stand on it. */
    float flat = 2e-7f * size_of(box);
    bool may_have_floor = false;
    for (int k = 0; k < 3; k++)
        may_have_floor |= is_far_side(scene, k, box, light, flat);
    if (!may_have_floor || p->index_count > *left) {
        memcpy(casters, box, 2 * sizeof *casters);
        return;
    }
    *left -= p->index_count;
    psc_bounds_clear(casters[0], casters[1]);
    for (uint32_t i = 0; i < p->index_count; i += 3) {
        float triangle[2][3];
        psc_bounds_clear(triangle[0], triangle[1]);
        for (uint32_t k = 0; k < 3; k++)
            psc_bounds_grow_points(instance->world,
                &blob->positions[blob->indices[p->first_index + i + k]], 1, triangle[0],
                triangle[1]);
        if (!is_backdrop(scene, (const float(*)[3])triangle, light, flat))
            grow(casters, (const float(*)[3])triangle);
    }
}

void casters_bounds(const struct scene *scene, const struct view *view, bool ground,
    const struct caster_light *light, float bounds[2][3], float within[2][3])
{
    float shown[2][3], some[2][3];
    uint32_t left = MOST_CORNERS;
    shown_bounds(scene, view, ground, shown);
    psc_bounds_clear(bounds[0], bounds[1]);
    psc_bounds_clear(some[0], some[1]);
    for (uint32_t i = 0; i < scene->blob.instance_count; i++) {
        const float(*all)[3] = (const float(*)[3])scene->instance_bounds[i];
        float box[2][3];
        if (casters_is_backdrop(scene, all[0], all[1], light))
            continue;
        instance_casters(scene, i, light, &left, box);
        if (box[0][0] > box[1][0])
            continue;
        grow(bounds, (const float(*)[3])box);
        if (shown[0][0] <= shown[1][0] &&
            may_cast(light, (const float(*)[3])shown, (const float(*)[3])box))
            grow(some, (const float(*)[3])box);
    }
    bool any = bounds[0][0] <= bounds[1][0], few = some[0][0] <= some[1][0];
    for (int k = 0; k < 3; k++)
        within[0][k] = -INFINITY, within[1][k] = INFINITY;
    if (few && size_of((const float(*)[3])some) < SMALL * size_of((const float(*)[3])bounds)) {
        memcpy(bounds, some, sizeof some);
        memcpy(within, some, sizeof some);
        grow(within, (const float(*)[3])shown);
    }
    if (any)
        return;
    /* Nothing casts; the window only has to be valid. */
    for (int k = 0; k < 3; k++) {
        bounds[0][k] = scene_is_empty(scene) ? -1 : scene->blob.header->bounds_min[k];
        bounds[1][k] = scene_is_empty(scene) ? 1 : scene->blob.header->bounds_max[k];
    }
}
