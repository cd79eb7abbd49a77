#pragma once
#include "renderer/import/convert/context.h"
#include "renderer/import/geometry/geometry.h"

/* How the points and lines of all primitives are drawn, before any is read: where there are very
 * many, by simpler solids, and then by every so many-th of them. */
void imp_marks_plan(struct imp_context *context);

/* Makes solids of points and lines (glTF's modes 0 to 3), whose corners stand in `indices`.
 * The positions as they were become its `points`. Errors: PEN_TOO_BIG. */
bool imp_marks_thicken(struct imp_context *context, struct imp_geometry *geometry, uint32_t mode,
    struct pen_error *error);
