/* Primitives with a skin or morph targets. */
#pragma once
#include "renderer/import/motion/motion.h"

/* Whether a primitive of a node's mesh has to be moved vertex by vertex. */
bool imp_deforms(
    const struct imp_context *context, const struct gltf_node *node, uint32_t primitive);

struct imp_deformed_primitive {
    uint32_t psc;          /* IMP_SKIPPED: there is nothing to draw */
    bool skinned;          /* the joints place it */
    double min[3], max[3]; /* at rest, in the file's world when joints place it, else the node's */
};
/* Adds it. Errors: PEN_INVALID, PEN_TOO_BIG. */
bool imp_add_deforming(struct imp_context *context, uint32_t node, uint32_t primitive,
    struct imp_deformed_primitive *added, struct pen_error *error);
/* The instance of what was last added with a skin. */
void imp_deforming_instance(struct imp_motion *motion, uint32_t instance);
