#pragma once
#include "renderer/import/convert/context.h"
#include "renderer/import/geometry/geometry.h"

/* Makes solids of points and lines (glTF's modes 0 to 3), whose corners stand in `indices`.
 * The positions as they were become its `points`. Errors: PEN_TOO_BIG. */
bool imp_marks_thicken(struct imp_context *context, struct imp_geometry *geometry, uint32_t mode,
    struct pen_error *error);
