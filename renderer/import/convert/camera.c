#include "renderer/import/convert/camera.h"
#include "renderer/blob/affine.h"
#include "renderer/import/base/budget.h"
#include "renderer/import/base/name.h"
#include "renderer/pose/place.h"
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

uint32_t imp_add_camera(struct imp_context *context, const struct gltf_camera *camera,
    const struct gltf_node *node, const double world[12], float ahead[2])
{
    struct psc_camera to = {0};
    double eye[3] = {world[3], world[7], world[11]}, axis[3];
    double scale = psc_affine_axis(world, 2, -1, axis);
    if (context->camera_count >= IMP_MAX_LIGHTS) {
        imp_warn(context, "Only the first %u cameras are kept.", IMP_MAX_LIGHTS);
        return IMP_SKIPPED;
    }
    double distance = focus(context, eye, axis), shift = 0;
    to.fov_y_deg = pose_fov_y_deg(camera->fov_y);
    if (!camera->perspective) {
        imp_warn(context,
            "Orthographic cameras become perspective ones of %d degrees, from farther away.",
            PARALLEL_FOV_DEG);
        to.fov_y_deg = PARALLEL_FOV_DEG;
        double back = fabs(camera->y_mag) * scale / tan(PARALLEL_FOV_DEG / 2.0 * M_PI / 180);
        shift = distance - back;
        distance = back;
    }
    ahead[0] = (float)shift;
    ahead[1] = (float)fmin(fmax(distance, 1e-9), PEN_FAR);
    if (!pose_place_camera(&to, world, ahead)) {
        imp_warn(context, "A camera farther than a million km from the origin is left out.");
        return IMP_SKIPPED;
    }
    imp_name(to.name, node->name, camera->name);
    context->camera_count++;
    return psc_builder_add_camera(context->builder, &to);
}
