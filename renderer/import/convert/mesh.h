#pragma once
#include "renderer/import/convert/context.h"
#include "renderer/import/geometry/geometry.h"

/* Adds the glTF primitive to the blob when it was not; *psc is IMP_SKIPPED when there is
 * nothing to draw. Errors: PEN_INVALID, PEN_TOO_BIG. */
bool imp_primitive(
    struct imp_context *context, uint32_t primitive, uint32_t *psc, struct pen_error *error);

/* A look at all counts before any vertex is read. Errors: PEN_TOO_BIG. */
bool imp_primitives_fit(const struct gltf_model *model, struct pen_error *error);

/* The triangles and vertices of a glTF primitive into an empty *geometry; no indices: there
 * is nothing to draw, and a warning said so. Errors: PEN_INVALID, PEN_TOO_BIG. */
bool imp_geometry_read(struct imp_context *context, uint32_t primitive,
    struct imp_geometry *geometry, struct pen_error *error);
/* Reads `components` floats of each vertex into an array that *out then points to; it stays NULL
 * when the primitive has no such attribute. Those that the accessor lacks are 1. */
bool imp_gather(struct imp_context *context, const struct imp_geometry *geometry, int32_t accessor,
    uint32_t least, uint32_t components, void *out, struct pen_error *error);
/* What the builder is to be given; the arrays stay the geometry's. */
struct psc_mesh imp_geometry_mesh(
    struct imp_context *context, uint32_t primitive, const struct imp_geometry *geometry);
