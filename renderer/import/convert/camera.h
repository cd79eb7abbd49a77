#pragma once
#include "renderer/import/convert/context.h"

/* Reads the bounds, so it comes after every instance. Returns its number in the blob, or
 * IMP_SKIPPED; `ahead`: from the node to the eye along the axis, from there to the target, m.
 * `world`: row-major 3x4. */
uint32_t imp_add_camera(struct imp_context *context, const struct gltf_camera *camera,
    const struct gltf_node *node, const double world[12], float ahead[2]);
