/* Tangents from texture coordinates, as a normal map is looked up: the direction of growing u,
 * summed up per vertex. What moves the whole mesh moves them alike: weights are taken in texture
 * space, and a tangent is made orthogonal to the normal where both are known in the world, so that a
 * node that shears gives what sheared vertices do. The bitangent, w * cross(normal, tangent), points
 * against growing v: up in the image, where green points. */
#include "protocol/memory.h"
#include "renderer/blob/geometry.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A triangle in the texture. */
struct patch {
    double uv[3][2];
    double area; /* twice, with its sign */
};

static struct patch patch_of(
    const struct geometry *g, const struct psc_texture_ref *map, const uint32_t *t)
{
    struct patch p;
    for (int c = 0; c < 3; c++) {
        const float *uv = g->uv[t[c]][map->uv_set & 1];
        for (int r = 0; r < 2; r++) /* without the offset, which is no direction */
            p.uv[c][r] =
                (double)map->transform[3 * r] * uv[0] + (double)map->transform[3 * r + 1] * uv[1];
    }
    p.area = (p.uv[1][0] - p.uv[0][0]) * (p.uv[2][1] - p.uv[0][1]) -
             (p.uv[2][0] - p.uv[0][0]) * (p.uv[1][1] - p.uv[0][1]);
    return p;
}

/* How far it goes per u, times the patch's area. */
static void gradient(
    const struct geometry *g, const uint32_t *t, const struct patch *p, double out[3])
{
    double dv1 = p->uv[1][1] - p->uv[0][1], dv2 = p->uv[2][1] - p->uv[0][1];
    for (int k = 0; k < 3; k++) {
        double e1 = (double)g->positions[t[1]][k] - g->positions[t[0]][k];
        double e2 = (double)g->positions[t[2]][k] - g->positions[t[0]][k];
        out[k] = (e1 * dv2 - e2 * dv1) * (p->area < 0 ? -1 : 1);
    }
}

static double corner_angle(const struct patch *p, int corner)
{
    const double *o = p->uv[corner], *q = p->uv[(corner + 1) % 3], *r = p->uv[(corner + 2) % 3];
    return fabs(atan2(p->area, (q[0] - o[0]) * (r[0] - o[0]) + (q[1] - o[1]) * (r[1] - o[1])));
}

static uint32_t copy_vertex(struct geometry *g, uint32_t from)
{
    if (g->vertex_count == g->vertex_capacity) {
        uint32_t n = g->vertex_capacity += g->vertex_capacity / 2 + 64;
        g->positions = pen_realloc_array(g->positions, n, sizeof *g->positions);
        g->normals = pen_realloc_array(g->normals, n, sizeof *g->normals);
        g->uv = pen_realloc_array(g->uv, n, sizeof *g->uv);
        g->colors = pen_realloc_array(g->colors, n, sizeof *g->colors);
        g->sources = pen_realloc_array(g->sources, n, sizeof *g->sources);
    }
    uint32_t to = g->vertex_count++;
    memcpy(g->positions[to], g->positions[from], sizeof g->positions[to]);
    memcpy(g->normals[to], g->normals[from], sizeof g->normals[to]);
    memcpy(g->uv[to], g->uv[from], sizeof g->uv[to]);
    memcpy(g->colors[to], g->colors[from], sizeof g->colors[to]);
    g->sources[to] = g->sources[from];
    return to;
}

/* One without a direction stays 0, and its vertex unbent. */
static void store(const double sum[3], bool mirrored, float tangent[4])
{
    double length = sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
    for (int k = 0; k < 3; k++)
        tangent[k] = length > 0 && isfinite(length) ? (float)(sum[k] / length) : 0;
    tangent[3] = mirrored ? -1 : 1;
}

void psc_geometry_make_tangents(struct geometry *g, const struct psc_texture_ref *map)
{
    uint32_t before = g->vertex_count;
    /* Per vertex and side. */
    double(*sums)[2][3] = pen_alloc(before, sizeof *sums);
    bool(*used)[2] = pen_alloc(before, sizeof *used);
    memset(sums, 0, before * sizeof *sums);
    memset(used, 0, before * sizeof *used);
    for (uint32_t i = 0; i < g->index_count; i += 3) {
        struct patch patch = patch_of(g, map, &g->indices[i]);
        double along[3];
        if (patch.area == 0)
            continue;
        gradient(g, &g->indices[i], &patch, along);
        for (int c = 0; c < 3; c++) {
            uint32_t v = g->indices[i + c];
            double weight = corner_angle(&patch, c);
            for (int k = 0; k < 3; k++)
                sums[v][patch.area > 0][k] += weight * along[k];
            used[v][patch.area > 0] = true;
        }
    }

    /* A vertex on the seam between mirrored halves gets a twin for the mirrored one. */
    uint32_t *twins = pen_alloc(before, sizeof *twins);
    for (uint32_t v = 0; v < before; v++)
        twins[v] = used[v][0] && used[v][1] ? copy_vertex(g, v) : v;
    for (uint32_t i = 0; g->vertex_count > before && i < g->index_count; i += 3)
        if (patch_of(g, map, &g->indices[i]).area > 0)
            for (int c = 0; c < 3; c++)
                g->indices[i + c] = twins[g->indices[i + c]];

    g->tangents = pen_alloc(g->vertex_count, sizeof *g->tangents);
    for (uint32_t v = 0; v < before; v++) {
        bool side = !used[v][0] && used[v][1];
        store(sums[v][side], side, g->tangents[v]);
        if (twins[v] != v)
            store(sums[v][1], true, g->tangents[twins[v]]);
    }
    free(twins);
    free(used);
    free(sums);
}
