/* The skins and animations of a glTF document, out of its JSON: shapes and indices into other
 * arrays are checked by the schema, samplers of channels here. */
#pragma once
#include "renderer/import/document/document.h"

struct gltf_skin {
    int32_t inverse_bind; /* accessor; -1: identities */
    uint32_t first_joint, joint_count;
};

struct gltf_animation_sampler {
    int32_t input, output;  /* accessors */
    uint32_t interpolation; /* enum psc_interpolation */
};

struct gltf_channel {
    uint32_t sampler; /* among all samplers */
    int32_t node;     /* -1: none */
    const char *path;
    const char *pointer; /* KHR_animation_pointer; NULL: none */
};

struct gltf_animation {
    const char *name; /* "" when it has none */
    uint32_t first_channel, channel_count;
    uint32_t first_sampler, sampler_count;
};

/* Strings belong to the document. */
struct gltf_motion {
    struct gltf_skin *skins;
    uint32_t *joints; /* nodes */
    struct gltf_animation *animations;
    struct gltf_channel *channels;
    struct gltf_animation_sampler *samplers;
    uint32_t skin_count, animation_count, channel_count, sampler_count;
};

/* On failure *motion is empty. Errors: PEN_INVALID, PEN_TOO_BIG. */
bool gltf_motion_read(
    struct gltf_motion *motion, const struct imp_document *document, struct pen_error *error);
void gltf_motion_finish(struct gltf_motion *motion);
