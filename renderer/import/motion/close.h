#pragma once
#include "renderer/import/motion/motion.h"

/* After the last node, when every number is known: adds all that moves to the blob. Errors:
 * PEN_INVALID, PEN_TOO_BIG. */
bool imp_motion_close(struct imp_context *context, struct pen_error *error);
