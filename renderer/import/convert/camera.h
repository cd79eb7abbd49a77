#pragma once
#include "renderer/import/convert/context.h"

/* Reads the bounds, so it comes after every instance. `world`: row-major 3x4. */
void imp_add_camera(struct imp_context *context, const struct gltf_camera *camera,
    const struct gltf_node *node, const double world[12]);
