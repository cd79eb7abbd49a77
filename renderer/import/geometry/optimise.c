#include "protocol/memory.h"
#include "renderer/import/geometry/geometry.h"
#include <meshoptimizer.h>
#include <stdlib.h>

#define MESHLET_VERTICES 128
#define CONE_WEIGHT 0.5f
#define STREAMS 7

struct stream {
    void **data;
    size_t item_bytes;
};

static unsigned list_streams(struct imp_geometry *g, struct stream streams[STREAMS])
{
    const struct stream all[] = {{(void **)&g->positions, sizeof *g->positions},
        {(void **)&g->normals, sizeof *g->normals}, {(void **)&g->tangents, sizeof *g->tangents},
        {(void **)&g->uv[0], sizeof *g->uv[0]}, {(void **)&g->uv[1], sizeof *g->uv[1]},
        {(void **)&g->colors, sizeof *g->colors}, {(void **)&g->used, sizeof *g->used}};
    unsigned count = 0;
    for (unsigned i = 0; i < STREAMS; i++)
        if (*all[i].data)
            streams[count++] = all[i];
    return count;
}

static void apply_remap(struct imp_geometry *g, const unsigned *remap, size_t new_count)
{
    struct stream streams[STREAMS];
    unsigned count = list_streams(g, streams);
    for (unsigned i = 0; i < count; i++) {
        void *moved = pen_alloc_zero(new_count, streams[i].item_bytes);
        meshopt_remapVertexBuffer(
            moved, *streams[i].data, g->vertex_count, streams[i].item_bytes, remap);
        free(*streams[i].data);
        *streams[i].data = moved;
    }
    meshopt_remapIndexBuffer(g->indices, g->indices, g->index_count, remap);
    g->vertex_count = (uint32_t)new_count;
}

static void weld(struct imp_geometry *g, unsigned *remap)
{
    struct stream streams[STREAMS];
    struct meshopt_Stream views[STREAMS];
    unsigned count = list_streams(g, streams);
    for (unsigned i = 0; i < count; i++)
        views[i] =
            (struct meshopt_Stream){*streams[i].data, streams[i].item_bytes, streams[i].item_bytes};
    size_t unique = meshopt_generateVertexRemapMulti(
        remap, g->indices, g->index_count, g->vertex_count, views, count);
    apply_remap(g, remap, unique);
}

/* Replaces the indices by those of the meshlets; leaves all as it was when the meshlets miss
 * triangles, as they do when areas overflow. */
static void build_meshlets(struct imp_geometry *g)
{
    size_t bound =
        meshopt_buildMeshletsBound(g->index_count, MESHLET_VERTICES, IMP_MESHLET_TRIANGLES);
    struct meshopt_Meshlet *meshlets = pen_alloc_zero(bound, sizeof *meshlets);
    unsigned *vertices = pen_alloc_zero(bound, MESHLET_VERTICES * sizeof *vertices);
    unsigned char *triangles = pen_alloc_zero(bound, IMP_MESHLET_TRIANGLES * 3);
    size_t count = meshopt_buildMeshlets(meshlets, vertices, triangles, g->indices, g->index_count,
        g->positions[0], g->vertex_count, sizeof *g->positions, MESHLET_VERTICES,
        IMP_MESHLET_TRIANGLES, CONE_WEIGHT);
    size_t covered = 0;
    for (size_t i = 0; i < count; i++)
        covered += meshlets[i].triangle_count;
    if (covered * 3 == g->index_count) {
        g->meshlet_triangles = pen_alloc_zero(count, sizeof *g->meshlet_triangles);
        g->meshlet_count = (uint32_t)count;
        uint32_t *out = g->indices;
        for (size_t i = 0; i < count; i++) {
            const struct meshopt_Meshlet *m = &meshlets[i];
            unsigned local[3 * IMP_MESHLET_TRIANGLES];
            size_t n = 3 * (size_t)m->triangle_count;
            g->meshlet_triangles[i] = m->triangle_count;
            for (size_t k = 0; k < n; k++)
                local[k] = triangles[m->triangle_offset + k];
            meshopt_optimizeVertexCache(local, local, n, m->vertex_count);
            for (size_t k = 0; k < n; k++)
                *out++ = vertices[m->vertex_offset + local[k]];
        }
    }
    free(meshlets);
    free(vertices);
    free(triangles);
}

/* The optimisers below look at all neighbours of a vertex, and at all triangles of a place,
 * for each of its triangles: their work grows with the sum of squares of how many corners meet
 * at a place. */
static uint64_t crowding(const struct imp_geometry *g, unsigned *remap)
{
    size_t places = meshopt_generateVertexRemap(
        remap, g->indices, g->index_count, g->positions, g->vertex_count, sizeof *g->positions);
    uint32_t *corners = pen_alloc_zero(places, sizeof *corners);
    for (uint32_t i = 0; i < g->index_count; i++)
        corners[remap[g->indices[i]]]++;
    uint64_t sum = 0;
    for (size_t i = 0; i < places; i++)
        sum += (uint64_t)corners[i] * corners[i];
    free(corners);
    return sum;
}

void imp_geometry_optimise(struct imp_geometry *g, uint64_t *work)
{
    if (g->meshlet_triangles)
        return;
    unsigned *remap = pen_alloc_zero(g->vertex_count, sizeof *remap);
    weld(g, remap);
    uint64_t crowd = crowding(g, remap);
    if (crowd <= *work) {
        *work -= crowd;
        meshopt_optimizeVertexCache(g->indices, g->indices, g->index_count, g->vertex_count);
        build_meshlets(g);
    }
    size_t used =
        meshopt_optimizeVertexFetchRemap(remap, g->indices, g->index_count, g->vertex_count);
    apply_remap(g, remap, used);
    free(remap);
}
