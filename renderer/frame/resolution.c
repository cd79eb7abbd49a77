#include "renderer/frame/resolution.h"
#include <cglm/cglm.h>

/* A texel as wide as a few pixels is blurred over; steps that large are seen. */
static const float coarse_pixels = 4;

/* To where the camera's axis meets a box or, from inside, leaves it, m; 0: it does not. */
static float distance_to(const struct view *view, const float min[3], const float max[3])
{
    float enter = -INFINITY, leave = INFINITY;
    for (int k = 0; k < 3; k++) {
        float a = (min[k] - view->eye[k]) / view->forward[k];
        float b = (max[k] - view->eye[k]) / view->forward[k];
        if (view->forward[k] == 0)
            a = -INFINITY, b = min[k] <= view->eye[k] && view->eye[k] <= max[k] ? INFINITY : a;
        enter = fmaxf(enter, fminf(a, b));
        leave = fminf(leave, fmaxf(a, b));
    }
    return enter < leave && leave > 0 ? (enter > 0 ? enter : leave) : 0;
}

/* How far the camera looks, m: to the box around the content; past it, to beside its centre; away from
 * it, to the box around all there is. */
static float focus_distance(const struct technique_run *run)
{
    const struct view *view = run->view;
    const struct psc_header *h = run->scene->blob.header;
    const float(*box)[3] = (const float(*)[3])run->scene->stage->content;
    float distance = distance_to(view, box[0], box[1]);
    if (distance <= 0)
        for (int k = 0; k < 3; k++)
            distance += (0.5f * (box[0][k] + box[1][k]) - view->eye[k]) * view->forward[k];
    if (distance <= 0)
        distance = distance_to(view, h->bounds_min, h->bounds_max);
    return fmaxf(distance, view->near_z);
}

/* Of the map in world space, where the light's depth is z, m. */
static float texel_width(const struct technique_run *run, float z)
{
    const struct light_face *face = run->face;
    float width = fmaxf(face->rect[2] - face->rect[0], face->rect[3] - face->rect[1]);
    return width / (float)run->map_size * (face->parallel ? 1 : z / face->near_z);
}

bool frame_warn_of_resolution(const struct technique_run *run)
{
    const struct light_face *face = run->face;
    if (!run->map_size || scene_is_empty(run->scene))
        return false;
    float distance = focus_distance(run), at[3];
    float pixel = 2 * distance * tanf(0.5f * run->view->fov_y_rad) / (float)run->view->height;
    glm_vec3_copy((float *)run->view->eye, at);
    glm_vec3_muladds((float *)run->view->forward, distance, at);
    glm_mat4_mulv3((vec4 *)face->world_to_light, at, 1, at);
    if (face->cube && (fabsf(at[0]) > at[2] || fabsf(at[1]) > at[2]))
        return false; /* another face's */
    float texel = texel_width(run, glm_clamp(at[2], face->near_z, face->far_z));
    if (texel <= coarse_pixels * pixel)
        return false;
    pen_result_warn(run->result,
        "Texels of the shadow map are %.0f pixels (%.2g m) wide where the camera looks: what is "
        "thinner casts no shadow, edges have steps. A larger map_size may help.",
        (double)(texel / pixel), (double)texel);
    return true;
}
