/* KHR_materials_variants: names of variants, and which primitives of the blob then have which other
 * material. */
#pragma once
#include "renderer/import/convert/context.h"

/* Notes a new primitive of the blob, with the materials that it may have. */
void imp_variants_note(struct imp_context *context, uint32_t primitive, uint32_t psc);
/* True when one of the materials that a primitive may have has a normal map. */
bool imp_variants_need_tangents(const struct imp_context *context, uint32_t primitive);
/* Puts all that was noted into the blob. */
void imp_variants_close(struct imp_context *context);
