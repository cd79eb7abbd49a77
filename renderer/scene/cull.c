#include "renderer/scene/cull.h"
#include <cglm/cglm.h>

/* Tests run in object space: planes and eye are brought there once per instance, and whether a
 * triangle faces a point does not change under an affine map (a mirroring one swaps it). */
struct object_view {
    vec4 planes[6];
    vec3 eye;
    bool cone;
};

static void object_matrix(const float world[12], mat4 m)
{
    glm_mat4_identity(m);
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 4; column++)
            m[column][row] = world[4 * row + column];
}

static void to_object(const struct cull_view *view, const struct psc_instance *instance,
    bool cull_back, struct object_view *out)
{
    mat4 world, clip, inverse;
    object_matrix(instance->world, world);
    glm_mat4_mul((vec4 *)view->world_to_clip, world, clip);
    for (int column = 0; column < 4; column++) {
        float x = clip[column][0], y = clip[column][1], z = clip[column][2], w = clip[column][3];
        out->planes[0][column] = w + x;
        out->planes[1][column] = w - x;
        out->planes[2][column] = w + y;
        out->planes[3][column] = w - y;
        out->planes[4][column] = z;
        out->planes[5][column] = w - z;
    }
    for (int i = 0; i < 6; i++) {
        float length = glm_vec3_norm(out->planes[i]);
        glm_vec4_scale(out->planes[i], length > 0 ? 1 / length : 1, out->planes[i]);
    }
    out->cone =
        cull_back && !(instance->flags & PSC_MIRRORED) && fabsf(glm_mat4_det(world)) > 1e-30f;
    if (!out->cone)
        return;
    glm_mat4_inv(world, inverse);
    glm_mat4_mulv3(inverse, (float *)view->eye, view->parallel ? 0 : 1, out->eye);
    if (view->parallel)
        glm_vec3_normalize(out->eye);
}

static bool is_visible(
    const struct object_view *view, bool parallel, const struct psc_meshlet *meshlet)
{
    const float *c = meshlet->center;
    for (int i = 0; i < 6; i++) {
        const float *p = view->planes[i];
        if (p[0] * c[0] + p[1] * c[1] + p[2] * c[2] + p[3] < -meshlet->radius)
            return false;
    }
    if (!view->cone || meshlet->cone_cutoff > 1)
        return true;
    const float *axis = meshlet->cone_axis;
    if (parallel)
        return view->eye[0] * axis[0] + view->eye[1] * axis[1] + view->eye[2] * axis[2] <
               meshlet->cone_cutoff;
    float d[3] = {c[0] - view->eye[0], c[1] - view->eye[1], c[2] - view->eye[2]};
    float distance = sqrtf(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    return d[0] * axis[0] + d[1] * axis[1] + d[2] * axis[2] <
           meshlet->cone_cutoff * distance + meshlet->radius;
}

uint64_t cull_instance(const struct cull_view *view, const struct psc_scene *blob,
    uint32_t instance, bool cull_back, struct cull_command *commands, uint32_t *count)
{
    const struct psc_primitive *primitive = &blob->primitives[blob->instances[instance].primitive];
    struct object_view object;
    to_object(view, &blob->instances[instance], cull_back, &object);
    uint64_t indices = 0;
    struct cull_command *run = NULL;
    for (uint32_t i = 0; i < primitive->meshlet_count; i++) {
        const struct psc_meshlet *meshlet = &blob->meshlets[primitive->first_meshlet + i];
        if (!is_visible(&object, view->parallel, meshlet))
            continue;
        indices += meshlet->index_count;
        if (run && run->first_index + run->count == meshlet->first_index) {
            run->count += meshlet->index_count;
            continue;
        }
        run = &commands[(*count)++];
        *run = (struct cull_command){meshlet->index_count, 1, meshlet->first_index, 0, instance};
    }
    return indices / 3;
}
