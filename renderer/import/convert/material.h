#pragma once
#include "renderer/import/convert/context.h"

/* The psc material of a glTF material (-1: the default one). */
uint32_t imp_material(struct imp_context *context, int32_t material);
/* What glTF says of it, before the blob's products and without its number. */
struct psc_material_rest imp_material_rest(const struct gltf_material *material);
/* The sets of texture coordinates that its textures use, of which a blob's vertices have two. They are the
 * same for all materials of a file that uses no more. */
void imp_material_uv_sets(struct imp_context *context, int32_t material, uint32_t sets[2]);
/* Where its normal map is looked up at rest; false when it has none. */
bool imp_material_normal_map(
    struct imp_context *context, int32_t material, struct psc_texture_ref *map);
