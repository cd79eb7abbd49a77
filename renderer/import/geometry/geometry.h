/* The triangles of one glTF primitive on their way into the blob. */
#pragma once
#include "renderer/blob/pscene.h"

struct imp_geometry {
    float (*positions)[3];
    float (*normals)[3]; /* each of these may be NULL */
    float (*tangents)[4];
    float (*uv[2])[2];
    float (*colors)[4];
    uint32_t *used;     /* number of each vertex in the file; such vertices are not welded */
    uint32_t used_of;   /* how many the file's primitive has */
    float (*points)[3]; /* that the positions are solids around; NULL: they are none */
    uint32_t point_count;
    float base[3]; /* that positions and points are relative to: solids are small, far from 0 */
    bool closed;   /* of solids that face outwards, as is known */
    struct psc_texture_ref normal_map; /* that tangents are made for */
    bool has_normal_map;
    uint32_t vertex_count;
    uint32_t *indices;
    uint32_t index_count;
    uint32_t *meshlet_triangles; /* NULL: none were built; else all is in a good order */
    uint32_t meshlet_count;
};

void imp_geometry_finish(struct imp_geometry *geometry);
/* Positions as the file has them, for what cannot be relative to anything. */
void imp_geometry_from_zero(struct imp_geometry *geometry);

/* optimise.c: welds equal vertices, orders triangles into meshlets of at most IMP_MESHLET_TRIANGLES
 * (compact ones with narrow normal cones, in an order kind to the vertex cache) and vertices by
 * first use. The set of triangles stays the same. Meshes that would cost more than is left of
 * *work, because very many triangles meet at one place, stay in their order, and so do those that
 * have meshlets. */
void imp_geometry_optimise(struct imp_geometry *geometry, uint64_t *work);
#define IMP_MESHLET_TRIANGLES 124
