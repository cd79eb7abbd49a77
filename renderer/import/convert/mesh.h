#pragma once
#include "renderer/import/convert/context.h"

/* Adds the glTF primitive to the blob when it was not; *psc is IMP_SKIPPED when there is
 * nothing to draw. Errors: PEN_INVALID, PEN_TOO_BIG. */
bool imp_primitive(
    struct imp_context *context, uint32_t primitive, uint32_t *psc, struct pen_error *error);

/* A look at all counts before any vertex is read. Errors: PEN_TOO_BIG. */
bool imp_primitives_fit(const struct gltf_model *model, struct pen_error *error);
