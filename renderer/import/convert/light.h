#pragma once
#include "renderer/import/convert/context.h"

/* `world`: row-major 3x4. */
void imp_add_light(struct imp_context *context, const struct gltf_light *light,
    const struct gltf_node *node, const double world[12]);
