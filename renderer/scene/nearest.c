/* How near a scene's surface comes to a point. */
#include "renderer/scene/scene.h"
#include <cglm/cglm.h>

#define MOST_TRIANGLES 30000u /* that are looked at one by one: about a millisecond */

static float box_distance(const float box[2][3], const float point[3])
{
    float sum = 0;
    for (int k = 0; k < 3; k++) {
        float d = fmaxf(fmaxf(box[0][k] - point[k], point[k] - box[1][k]), 0);
        sum += d * d;
    }
    return sqrtf(sum);
}

/* From the origin to the segment between two points. */
static float segment_distance(const float a[3], const float b[3])
{
    vec3 along, at;
    glm_vec3_sub((float *)b, (float *)a, along);
    float length = glm_vec3_norm2(along);
    float t = length > 0 ? glm_clamp(-glm_vec3_dot((float *)a, along) / length, 0, 1) : 0;
    for (int k = 0; k < 3; k++)
        at[k] = a[k] + t * along[k];
    return glm_vec3_norm(at);
}

/* From the origin; where it lies above the triangle, to its plane. */
static float triangle_distance(const float corners[3][3])
{
    vec3 edges[2], normal, side;
    bool inside = true;
    float least = INFINITY;
    for (int k = 0; k < 2; k++)
        glm_vec3_sub((float *)corners[k + 1], (float *)corners[0], edges[k]);
    glm_vec3_cross(edges[0], edges[1], normal);
    for (int k = 0; k < 3; k++) {
        const float *a = corners[k], *b = corners[(k + 1) % 3];
        glm_vec3_cross((float *)a, (float *)b, side);
        inside = inside && glm_vec3_dot(side, normal) >= 0;
        least = fminf(least, segment_distance(a, b));
    }
    float size = glm_vec3_norm(normal);
    return inside && size > 0 ? fabsf(glm_vec3_dot(normal, (float *)corners[0])) / size : least;
}

static void place(const float world[12], const float at[3], const float point[3], float out[3])
{
    for (int row = 0; row < 3; row++) {
        const float *m = world + 4 * row;
        out[row] = m[0] * at[0] + m[1] * at[1] + m[2] * at[2] + (m[3] - point[row]);
    }
}

static float meshlet_distance(const struct psc_scene *blob, const struct psc_meshlet *meshlet,
    const float world[12], const float point[3], float least)
{
    const uint32_t *t = blob->indices + meshlet->first_index;
    for (uint32_t i = 0; i < meshlet->index_count; i += 3) {
        float corners[3][3];
        for (int k = 0; k < 3; k++)
            place(world, blob->positions[t[i + (uint32_t)k]], point, corners[k]);
        least = fminf(least, triangle_distance((const float(*)[3])corners));
    }
    return least;
}

float scene_nearest(const struct scene *s, const float point[3], float most)
{
    uint32_t left = MOST_TRIANGLES;
    const struct psc_scene *blob = &s->blob;
    for (uint32_t i = 0; i < blob->instance_count; i++) {
        if (box_distance((const float(*)[3])s->instance_bounds[i], point) >= most)
            continue;
        const float *world = blob->instances[i].world;
        float scale = 0; /* no vector grows by more */
        for (int k = 0; k < 12; k++)
            scale += k % 4 < 3 ? world[k] * world[k] : 0;
        scale = sqrtf(scale);
        const struct psc_primitive *p = &blob->primitives[blob->instances[i].primitive];
        for (uint32_t m = 0; m < p->meshlet_count; m++) {
            const struct psc_meshlet *meshlet = &blob->meshlets[p->first_meshlet + m];
            vec3 center;
            place(world, meshlet->center, point, center);
            float bound = glm_vec3_norm(center) - scale * meshlet->radius;
            uint32_t triangles = meshlet->index_count / 3;
            if (bound >= most)
                continue;
            if (triangles > left)
                most = fmaxf(bound, 0);
            else
                left -= triangles, most = meshlet_distance(blob, meshlet, world, point, most);
        }
    }
    return most;
}
