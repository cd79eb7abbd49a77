/* One conversion of a glTF document into a scene blob: what its parts share. */
#pragma once
#include "renderer/blob/builder.h"
#include "renderer/import/base/text.h"
#include "renderer/import/document/document.h"
#include "renderer/import/document/gltf_tiny.h"

/* What a texture is for. */
enum imp_role {
    IMP_BASE,
    IMP_GLOSS,
    IMP_EMISSION,
    IMP_SURFACE,
    IMP_NORMAL,
    IMP_OCCLUSION,
    IMP_ROLES
};

/* A psc image to be: the same glTF image read as sRGB and as linear data is two of them, and one
 * that cannot be decoded stands for something else in every role. */
struct imp_image_slot {
    uint32_t image; /* glTF's number; IMP_NOT_YET: none that can be read */
    enum imp_role role;
};

struct imp_context {
    struct imp_document *document;
    struct gltf_model *model;
    struct psc_builder *builder;

    uint64_t index_count, vertex_count, instance_count; /* against budget.h */
    uint64_t optimiser_work;                            /* what is left of IMP_MAX_OPTIMISER_WORK */
    uint32_t light_count, camera_count;
    float brightest; /* of the lights' intensities */
    struct imp_dim { /* the light of the least, but for none */
        char name[sizeof(struct imp_text) + 12];
        const char *unit;
        float intensity;
    } dimmest;

    uint32_t *primitives; /* psc number of each glTF primitive, or one of the two below */
    /* psc number of each glTF material and, last, of none; UINT32_MAX: not yet. */
    uint32_t *materials;
    struct imp_uv_sets { /* material.h */
        bool planned, few;
        uint32_t sets[2]; /* few: of all materials */
    } uv_sets;
    uint32_t *textures; /* psc number of each glTF texture in each role */
    struct imp_image_slot *image_slots;
    uint32_t image_slot_count;

    uint32_t *stamps; /* mesh.c: the last primitive that used a vertex, and its number there */
    uint32_t *stamped;
    uint64_t stamp_capacity;
    uint32_t stamp;

    double bounds_min[3], bounds_max[3]; /* world, over the instances so far; min > max: none */
    struct primitive_bounds {
        double min[3], max[3];
    } * primitive_bounds; /* object space, by glTF primitive */

    struct imp_motion *motion; /* motion.h */

    struct imp_marks {   /* marks.h */
        uint32_t stride; /* every so many of the points and lines is drawn */
        bool plain;
    } marks;

    struct imp_swap { /* variants.h */
        uint32_t variant, order;
        struct psc_swap swap;
    } * swaps;
    uint32_t swap_count;
    size_t swap_room;

    uint64_t *warned; /* hashes of the warnings given */
    uint32_t warned_count;
};

#define IMP_NOT_YET UINT32_MAX
#define IMP_SKIPPED (UINT32_MAX - 1) /* nothing to draw */

/* Adds a warning to the blob unless the same text stands there; beyond IMP_MAX_WARNINGS nothing. */
void imp_warn(struct imp_context *context, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
