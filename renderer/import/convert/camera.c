#include "renderer/import/convert/camera.h"
#include "renderer/blob/affine.h"
#include "renderer/import/base/budget.h"
#include "renderer/import/convert/name.h"
#include <string.h>

#define PARALLEL_FOV_DEG 10 /* of the perspective that stands in for an orthographic camera */

/* How far ahead of the eye the middle of the scene is; 1 when it is behind, or nowhere. */
static double focus(const struct imp_context *context, const double eye[3], const double axis[3])
{
    double distance = 0;
    for (int i = 0; i < 3; i++)
        distance += ((context->bounds_min[i] + context->bounds_max[i]) / 2 - eye[i]) * axis[i];
    return context->bounds_min[0] <= context->bounds_max[0] && distance > 0 ? distance : 1;
}

void imp_add_camera(struct imp_context *context, const struct gltf_camera *camera,
    const struct gltf_node *node, const double world[12])
{
    struct psc_camera to = {0};
    double eye[3] = {world[3], world[7], world[11]}, up[3], axis[3];
    psc_affine_axis(world, 1, 1, up);
    double scale = psc_affine_axis(world, 2, -1, axis);
    if (context->camera_count >= IMP_MAX_LIGHTS) {
        imp_warn(context, "Only the first %u cameras are kept.", IMP_MAX_LIGHTS);
        return;
    }
    double distance = focus(context, eye, axis), fov = camera->fov_y * 180 / M_PI;
    if (!camera->perspective) {
        imp_warn(context,
            "Orthographic cameras become perspective ones of %d degrees, from farther away.",
            PARALLEL_FOV_DEG);
        fov = PARALLEL_FOV_DEG;
        double back = fabs(camera->y_mag) * scale / tan(fov / 2 * M_PI / 180);
        for (int i = 0; i < 3; i++)
            eye[i] += axis[i] * (distance - back);
        distance = back;
    }
    if (!(fov > 0))
        fov = 45;
    distance = fmin(fmax(distance, 1e-9), PEN_FAR);
    for (int i = 0; i < 3; i++) {
        if (!(fabs(eye[i]) < PEN_FAR)) {
            imp_warn(context, "A camera farther than a million km from the origin is left out.");
            return;
        }
        to.eye[i] = eye[i];
        to.target[i] = fmin(fmax(eye[i] + axis[i] * distance, -PEN_FAR), PEN_FAR);
        to.up[i] = (float)up[i];
    }
    to.fov_y_deg = (float)fmin(fmax(fov, 1), 170);
    imp_name(to.name, node->name, camera->name);
    psc_builder_add_camera(context->builder, &to);
    context->camera_count++;
}
