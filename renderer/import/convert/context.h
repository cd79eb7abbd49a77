/* One conversion of a glTF document into a scene blob: what its parts share. */
#pragma once
#include "renderer/blob/builder.h"
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

    uint32_t *primitives; /* psc number of each glTF primitive, or one of the two below */
    /* psc number of each glTF material and, last, of none; UINT32_MAX: not yet. */
    uint32_t *materials;
    uint32_t *textures; /* psc number of each glTF texture in each role */
    struct imp_image_slot *image_slots;
    uint32_t image_slot_count;

    uint32_t *stamps; /* mesh.c: the last primitive that used a vertex, and its number there */
    uint32_t *stamped;
    uint64_t stamp_capacity;
    uint32_t stamp;

    double bounds_min[3], bounds_max[3]; /* world, over the instances so far; min > max: none */
    struct primitive_bounds {
        float min[3], max[3];
    } * primitive_bounds; /* object space, by glTF primitive */

    uint64_t *warned; /* hashes of the warnings given */
    uint32_t warned_count;
};

#define IMP_NOT_YET UINT32_MAX
#define IMP_SKIPPED (UINT32_MAX - 1) /* nothing to draw */

/* Adds a warning to the blob unless the same text stands there; beyond IMP_MAX_WARNINGS nothing. */
void imp_warn(struct imp_context *context, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/* scene.c: everything. The context's lists are freed before it returns. */
bool imp_convert(struct imp_document *document, struct gltf_model *model,
    struct psc_builder *builder, struct pen_error *error);

/* mesh.c: adds the glTF primitive to the blob when it was not; *psc is IMP_SKIPPED when there is
 * nothing to draw. Errors: PEN_INVALID, PEN_TOO_BIG. */
bool imp_primitive(
    struct imp_context *context, uint32_t primitive, uint32_t *psc, struct pen_error *error);

/* A look at all counts before any vertex is read. Errors: PEN_TOO_BIG. */
bool imp_primitives_fit(const struct gltf_model *model, struct pen_error *error);

/* material.c: the psc material of a glTF material (-1: the default one). */
uint32_t imp_material(struct imp_context *context, int32_t material);
/* True when it needs tangents. */
bool imp_material_has_normal_map(const struct imp_context *context, int32_t material);

/* texture.c: the psc texture of a glTF texture; -1 when there is no such texture. One without an
 * image that can be decoded becomes plain, so that the material's other values show. */
int32_t imp_texture(struct imp_context *context, int32_t texture, enum imp_role role);
/* Decodes every image that a texture asked for, in the order of their slots. */
bool imp_add_images(struct imp_context *context, struct pen_error *error);

/* node.c: walks the scene and adds instances; lights and cameras go to the two below. Matrices are
 * row-major 3x4. */
bool imp_add_nodes(struct imp_context *context, struct pen_error *error);
/* light.c */
void imp_add_light(struct imp_context *context, const struct gltf_light *light,
    const struct gltf_node *node, const double world[12]);
/* camera.c; reads the bounds, so it comes after every instance. */
void imp_add_camera(struct imp_context *context, const struct gltf_camera *camera,
    const struct gltf_node *node, const double world[12]);
/* camera.c: the first name that is not empty, cut at a character's end,
 * without control characters. */
void imp_name(char to[GLTF_NAME_BYTES], const char *preferred, const char *otherwise);
