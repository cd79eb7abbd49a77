#pragma once
#include "renderer/import/convert/context.h"
#include "renderer/import/document/motion.h"

/* What a channel writes, in the file's numbers. */
struct imp_aim {
    int32_t target; /* enum psc_channel_target; -1: nothing that is drawn */
    bool mesh;      /* WEIGHTS: of a mesh, not of a node */
    uint32_t item;
    uint32_t part; /* a texture: its slot in a material; WEIGHTS: 1 + the only one; else 0 */
};
struct imp_aim imp_aim(struct imp_context *context, const struct gltf_channel *channel);
