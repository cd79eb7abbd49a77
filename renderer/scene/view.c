#include "renderer/scene/view.h"
#include <cglm/cglm.h>
#include <string.h>

static void make_matrices(struct view *v, float jitter_x, float jitter_y)
{
    float f = 1 / tanf(0.5f * v->fov_y_rad);
    mat4 world_to_view = {{v->right[0], v->up[0], -v->forward[0], 0},
        {v->right[1], v->up[1], -v->forward[1], 0}, {v->right[2], v->up[2], -v->forward[2], 0},
        {-glm_vec3_dot(v->right, v->eye), -glm_vec3_dot(v->up, v->eye),
            glm_vec3_dot(v->forward, v->eye), 1}};
    /* Reversed infinite depth keeps precision far away; with GL_UPPER_LEFT clip control +y is up
     * and row 0 of the image is the top. A pixel shift is a shear along the view axis. */
    mat4 view_to_clip = {{f / v->aspect, 0, 0, 0}, {0, f, 0, 0},
        {-2 * jitter_x / (float)v->width, 2 * jitter_y / (float)v->height, 0, -1},
        {0, 0, v->near_z, 0}};
    glm_mat4_mul(view_to_clip, world_to_view, v->world_to_clip);
    glm_mat4_inv_precise(v->world_to_clip, v->clip_to_world);
}

/* The least distance from the centre at which all corners of the bounds are in the picture: each
 * corner asks for its own, by similar triangles. */
static float framing_distance(const struct scene *scene, const float center[3],
    const float direction[3], float fov_y_rad, float aspect)
{
    float right[3], up[3], world_up[3] = {0, 1, 0}, least = 0;
    glm_vec3_cross(world_up, (float *)direction, right);
    glm_vec3_normalize(right);
    glm_vec3_cross((float *)direction, right, up);
    float tan_y = tanf(0.5f * fov_y_rad), tan_x = tan_y * aspect;
    for (int i = 0; i < 8; i++) {
        float d[3];
        for (int k = 0; k < 3; k++)
            d[k] = scene->content[i >> k & 1][k] - center[k];
        float toward = glm_vec3_dot(d, (float *)direction);
        least = fmaxf(least, toward + fabsf(glm_vec3_dot(d, right)) / tan_x);
        least = fmaxf(least, toward + fabsf(glm_vec3_dot(d, up)) / tan_y);
    }
    return least;
}

static void frame_bounds(struct pen_camera *c, const struct scene *scene, float aspect)
{
    float center[3], distance = c->distance;
    scene_center(scene, center);
    float azimuth = glm_rad(c->azimuth_deg), elevation = glm_rad(c->elevation_deg);
    float direction[3] = {
        sinf(azimuth) * cosf(elevation), sinf(elevation), cosf(azimuth) * cosf(elevation)};
    if (distance <= 0 && !scene_is_empty(scene))
        distance =
            1.06f * framing_distance(scene, center, direction, glm_rad(c->fov_y_deg), aspect);
    if (distance <= 0)
        distance = 3 * scene_radius(scene);
    for (int i = 0; i < 3; i++) {
        c->target[i] = center[i];
        c->eye[i] = center[i] + distance * direction[i];
    }
    c->up[0] = 0, c->up[1] = 1, c->up[2] = 0;
}

bool view_resolve(struct view *v, struct pen_camera *c, const struct scene *scene, uint32_t width,
    uint32_t height, struct pen_error *error)
{
    memset(v, 0, sizeof *v);
    v->width = width, v->height = height;
    v->aspect = (float)width / (float)height;
    if (c->mode == PEN_CAMERA_INDEX) {
        if (c->index >= scene->blob.camera_count)
            return pen_fail(error, PEN_INVALID, "/camera/index",
                "The scene has %u cameras; there is no number %u.", scene->blob.camera_count,
                c->index);
        const struct psc_camera *from = &scene->blob.cameras[c->index];
        memcpy(c->eye, from->eye, sizeof c->eye);
        memcpy(c->target, from->target, sizeof c->target);
        memcpy(c->up, from->up, sizeof c->up);
        c->fov_y_deg = from->fov_y_deg;
    } else if (c->mode == PEN_CAMERA_AUTO || c->mode == PEN_CAMERA_ORBIT) {
        frame_bounds(c, scene, v->aspect);
    }
    c->mode = PEN_CAMERA_LOOK_AT;
    memcpy(v->eye, c->eye, sizeof v->eye);
    for (int i = 0; i < 3; i++)
        v->forward[i] = c->target[i] - c->eye[i];
    glm_vec3_normalize(v->forward);
    glm_vec3_cross(v->forward, c->up, v->right);
    if (glm_vec3_norm(v->right) < 1e-4f * glm_vec3_norm(c->up)) {
        /* Looking along `up`: any other axis will do. */
        float other[3] = {0, 0, 0};
        other[fabsf(v->forward[2]) < 0.9f ? 2 : 0] = -1;
        glm_vec3_cross(v->forward, other, v->right);
    }
    glm_vec3_normalize(v->right);
    glm_vec3_cross(v->right, v->forward, v->up);
    v->fov_y_rad = glm_rad(c->fov_y_deg);
    /* Depth is reversed and infinite: a small near plane costs no precision. */
    v->near_z = 1e-3f * scene_radius(scene);
    make_matrices(v, 0, 0);
    return true;
}

void view_jitter(struct view *v, float x, float y)
{
    make_matrices(v, x, y);
}

void view_to_cull(const struct view *v, struct cull_view *cull)
{
    memset(cull, 0, sizeof *cull);
    memcpy(cull->world_to_clip, v->world_to_clip, sizeof cull->world_to_clip);
    memcpy(cull->eye, v->eye, sizeof cull->eye);
    cull->cull_back = true;
}
