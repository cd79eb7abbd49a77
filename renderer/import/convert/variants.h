/* KHR_materials_variants: names of variants, and which primitives of the blob then have which other
 * material. */
#pragma once
#include "renderer/import/convert/context.h"

/* Notes a new primitive of the blob, with the materials that it may have. */
void imp_variants_note(struct imp_context *context, uint32_t primitive, uint32_t psc);
/* Where the normal map of a primitive's material is looked up or, when that has none, the first one of
 * the materials that it may have; false when none has one. */
bool imp_variants_normal_map(
    struct imp_context *context, uint32_t primitive, struct psc_texture_ref *map);
/* Puts all that was noted into the blob. */
void imp_variants_close(struct imp_context *context);
