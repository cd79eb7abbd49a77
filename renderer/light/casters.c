#include "renderer/light/casters.h"
#include "renderer/blob/bounds.h"
#include <cglm/cglm.h>
#include <string.h>

#define SHOWN 1.0f  /* px across: what is smaller receives no shadow that is seen */
#define SMALL 0.25f /* of all that casts, across: so much less is worth maps that follow the view */

bool casters_is_backdrop(const struct scene *scene, const float min[3], const float max[3],
    const struct caster_light *light)
{
    const struct psc_header *h = scene->blob.header;
    const float *sun = light->sun, *at = light->origin;
    float flat = 1e-4f * scene_radius(scene);
    for (int k = 0; k < 3; k++) {
        if (max[k] - min[k] > flat)
            continue;
        bool light_above = sun ? sun[k] < 0 : at[k] > max[k];
        bool light_below = sun ? sun[k] > 0 : at[k] < min[k];
        if ((light_above && min[k] <= h->bounds_min[k] + flat) ||
            (light_below && max[k] >= h->bounds_max[k] - flat))
            return true;
    }
    return false;
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

static float size_of(const float box[2][3])
{
    float size[3];
    glm_vec3_sub((float *)box[1], (float *)box[0], size);
    return glm_vec3_norm(size);
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

void casters_bounds(const struct scene *scene, const struct view *view, bool ground,
    const struct caster_light *light, float bounds[2][3], float within[2][3])
{
    float shown[2][3], some[2][3];
    shown_bounds(scene, view, ground, shown);
    psc_bounds_clear(bounds[0], bounds[1]);
    psc_bounds_clear(some[0], some[1]);
    for (uint32_t i = 0; i < scene->blob.instance_count; i++) {
        const float(*box)[3] = (const float(*)[3])scene->instance_bounds[i];
        if (casters_is_backdrop(scene, box[0], box[1], light))
            continue;
        grow(bounds, box);
        if (shown[0][0] <= shown[1][0] && may_cast(light, (const float(*)[3])shown, box))
            grow(some, box);
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
