/* The camera of a request, resolved against a scene. */
#pragma once
#include "renderer/scene/scene.h"
#include <cglm/types.h>

struct view {
    float eye[3], forward[3], right[3], up[3]; /* world, orthonormal */
    float fov_y_rad, aspect, near_z;
    mat4 world_to_clip; /* depth reversed: near 1, infinity 0; row 0 of the image on top */
    mat4 clip_to_world;
    uint32_t width, height;
};

/* Resolves the camera (auto, index and orbit become look-at in *camera) and fills *view. Errors:
 * PEN_INVALID when the scene has no such camera. */
bool view_resolve(struct view *view, struct pen_camera *camera, const struct scene *scene,
    uint32_t width, uint32_t height, struct pen_error *error);

/* Moves the pixel grid within half a pixel for antialiasing: to point `index` of a sequence. */
void view_jitter(struct view *view, uint32_t index);
void view_to_cull(const struct view *view, struct cull_view *cull);
