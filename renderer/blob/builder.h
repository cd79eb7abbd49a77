/* Builds a scene blob in memory: used by the importer and by the built-in scenes. Not thread-safe;
 * one builder, one owner. */
#pragma once
#include "renderer/blob/pscene.h"

struct psc_builder;

struct psc_builder *psc_builder_create(
    void); /* aborts on out of memory, like all allocation here */
void psc_builder_destroy(struct psc_builder *builder);

/* How a mesh's vertices move, in the caller's vertex numbers. */
struct psc_mesh_deform {
    const struct psc_influence *influences; /* `influence_count` for each vertex; NULL: no skin */
    uint32_t influence_count;               /* 0, 4 or 8 */
    const struct psc_delta *const *targets; /* vertices increase within each */
    const uint32_t *delta_counts;
    uint32_t target_count;
};

struct psc_mesh {
    const float (*positions)[3];
    const float (*normals)[3];  /* NULL: flat normals are generated (vertices are split) */
    const float (*tangents)[4]; /* NULL: made for `normal_map` */
    const float (*uv0)[2];      /* NULL: zero */
    const float (*uv1)[2];      /* NULL: zero */
    const float (*colors)[4];   /* NULL: white */
    uint32_t vertex_count;
    const uint32_t *indices; /* NULL: 0 .. vertex_count - 1 */
    uint32_t index_count;    /* a multiple of 3 */
    uint32_t material;
    const struct psc_texture_ref *normal_map; /* NULL: there is none to bend normals */
    /* When not NULL: triangles per meshlet, in order, each at most PSC_MESHLET_TRIANGLES (what an
     * optimiser found). NULL: consecutive runs. */
    const uint32_t *meshlet_triangles;
    uint32_t meshlet_count;
    const float (*points)[3]; /* what the mesh stands for, for the extent; NULL: its positions */
    uint32_t point_count;
    float base[3]; /* that positions and points are relative to; 0 for psc_builder_add_deforming */
    bool closed;   /* known to be of closed parts that face outwards; else that is found out */
};

/* Each returns the new item's number. Inputs are copied. */
uint32_t psc_builder_add_material(struct psc_builder *builder, const struct psc_material *material);
uint32_t psc_builder_add_texture(struct psc_builder *builder, const struct psc_texture *texture);
/* RGBA8, top row first; the mip chain is made here (box filter, in linear light when srgb). */
uint32_t psc_builder_add_image(
    struct psc_builder *builder, uint32_t width, uint32_t height, bool srgb, const uint8_t *rgba);
uint32_t psc_builder_add_light(struct psc_builder *builder, const struct psc_light *light);
uint32_t psc_builder_add_camera(struct psc_builder *builder, const struct psc_camera *camera);
void psc_builder_add_warning(struct psc_builder *builder, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
/* Items of a section of motion.h; returns the number of the first. */
uint32_t psc_builder_add_motion(
    struct psc_builder *builder, enum psc_section_id section, const void *items, uint32_t count);

/* Adds triangles. Degenerate ones are kept; an index out of range, a non-finite position or more
 * than 2^31 indices in total fails with PEN_INVALID. */
bool psc_builder_add_mesh(struct psc_builder *builder, const struct psc_mesh *mesh,
    uint32_t *primitive, struct pen_error *error);
/* The same of a mesh that moves, given before morphing and skinning. Fills what the builder knows of
 * *deform: the caller completes and adds it, and renderer/pose/bake.h makes the rest pose. */
bool psc_builder_add_deforming(struct psc_builder *builder, const struct psc_mesh *mesh,
    const struct psc_mesh_deform *how, struct psc_deform *deform, struct pen_error *error);
/* world: row-major 3x4, of the vertices as they were given. What lies far from the world's origin is
 * kept relative to one that psc_builder_finish chooses. Each returns the instance's number. */
uint32_t psc_builder_add_instance(
    struct psc_builder *builder, uint32_t primitive, const float world[12]);
uint32_t psc_builder_place_instance(
    struct psc_builder *builder, uint32_t primitive, const double world[12]);
/* One whose vertices move: `min`, `max` are its bounds in the file's world at rest. */
uint32_t psc_builder_place_deforming(struct psc_builder *builder, uint32_t primitive,
    const double world[12], const double min[3], const double max[3]);
void psc_builder_hide_instance(struct psc_builder *builder, uint32_t instance);

/* A default material: base colour white, roughness 1, metallic 0, no textures. */
struct psc_material psc_material_default(void);

/* The finished file. The caller frees *data. */
bool psc_builder_finish(struct psc_builder *builder, const uint8_t source[PEN_ID_BYTES],
    void **data, size_t *bytes, struct pen_error *error);
