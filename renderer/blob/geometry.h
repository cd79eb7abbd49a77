/* What the builder does to one mesh; private to renderer/blob. */
#pragma once
#include "renderer/blob/bounds.h"
#include "renderer/blob/builder.h"

/* A mesh on its way into the builder: arrays of its own, indices relative to it. */
struct geometry {
    float (*positions)[3];
    float (*normals)[3];  /* unit */
    float (*tangents)[4]; /* unit or 0, w +-1; NULL: none */
    float (*uv)[2][2];
    uint8_t (*colors)[4];
    uint32_t *sources; /* the caller's vertex that each was made of */
    uint32_t vertex_count, vertex_capacity;
    uint32_t *indices;
    uint32_t index_count;
};

/* Copies and checks `mesh`; generates flat normals (which split every vertex) and tangents. */
bool psc_geometry_create(
    struct geometry *geometry, const struct psc_mesh *mesh, struct pen_error *error);
void psc_geometry_finish(struct geometry *geometry);

/* Fills geometry->tangents from the uv that a normal map is looked up at; vertices used with both
 * handednesses are split. */
void psc_geometry_make_tangents(struct geometry *geometry, const struct psc_texture_ref *map);

/* enum psc_primitive_flags. Watertight: every edge, vertices joined by position, is shared by exactly
 * two triangles that run through it in opposite directions. Triangles without three distinct corners
 * are ignored. */
uint32_t psc_surface_flags(const float (*positions)[3], uint32_t vertex_count,
    const uint32_t *indices, uint32_t index_count);

/* Fills the levels after the first of an RGBA8 chain that starts at `texels`. */
void psc_make_mips(uint8_t *texels, uint32_t width, uint32_t height, bool srgb);
