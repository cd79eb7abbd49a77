/* The rest pose of a blob that was just built, and what of its motion is worth keeping. */
#pragma once
#include "renderer/blob/pscene.h"

/* The vertices of what deforms in the blob at `data` are those before deforming; they, and all that
 * follows from them, become those of the rest pose. Without animations the sections of motion.h are
 * cut off, and *bytes shrinks. Errors: PEN_INVALID. */
bool pose_bake(void *data, size_t *bytes, struct pen_error *error);
