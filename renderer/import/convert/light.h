#pragma once
#include "renderer/import/convert/context.h"

/* Returns its number in the blob, or IMP_SKIPPED; hidden: it has no colour. `world`: row-major 3x4.
 */
uint32_t imp_add_light(struct imp_context *context, const struct gltf_light *light,
    const struct gltf_node *node, const double world[12], bool hidden);
/* Once all are added: warns of one that cannot be seen beside the others. */
void imp_lights_close(struct imp_context *context);
/* What glTF says of it, without the light's number in the blob. */
struct psc_light_rest imp_light_rest(const struct gltf_light *light);
/* Height and width of an area light before scaling. */
void imp_light_size(const struct gltf_light *light, float size[2]);
