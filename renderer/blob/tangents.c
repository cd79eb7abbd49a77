/* Tangents from texture coordinates: each triangle's direction of growing u, accumulated per vertex
 * with the corner's angle as weight, then made orthogonal to the normal. The bitangent,
 * w * cross(normal, tangent), points against growing v: up in the image, where green points. */
#include "protocol/memory.h"
#include "renderer/blob/geometry.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Direction of growing u (unit) and the sign of the uv area; false when uv or
 * positions span none. */
static bool triangle_tangent(
    const struct geometry *g, const uint32_t *t, double tangent[3], int *side)
{
    const float(*uv[3])[2] = {g->uv[t[0]], g->uv[t[1]], g->uv[t[2]]};
    double du1 = (double)uv[1][0][0] - uv[0][0][0], dv1 = (double)uv[1][0][1] - uv[0][0][1];
    double du2 = (double)uv[2][0][0] - uv[0][0][0], dv2 = (double)uv[2][0][1] - uv[0][0][1];
    double area = du1 * dv2 - du2 * dv1;
    if (area == 0)
        return false;
    double length = 0;
    for (int k = 0; k < 3; k++) {
        double e1 = (double)g->positions[t[1]][k] - g->positions[t[0]][k];
        double e2 = (double)g->positions[t[2]][k] - g->positions[t[0]][k];
        tangent[k] = (e1 * dv2 - e2 * dv1) * (area < 0 ? -1 : 1);
        length += tangent[k] * tangent[k];
    }
    length = sqrt(length);
    if (!(length > 0))
        return false;
    for (int k = 0; k < 3; k++)
        tangent[k] /= length;
    *side = area > 0;
    return true;
}

static double corner_angle(const struct geometry *g, const uint32_t *t, int corner)
{
    const float *p = g->positions[t[corner]];
    const float *q = g->positions[t[(corner + 1) % 3]], *r = g->positions[t[(corner + 2) % 3]];
    double qq = 0, rr = 0, qr = 0;
    for (int k = 0; k < 3; k++) {
        double a = (double)q[k] - p[k], b = (double)r[k] - p[k];
        qq += a * a;
        rr += b * b;
        qr += a * b;
    }
    double cosine = qr / sqrt(qq * rr);
    return cosine >= 1 || !(qq * rr > 0) ? 0 : cosine <= -1 ? M_PI : acos(cosine);
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

/* The unit vector across n nearest to sum, or any when there is none. */
static void orthonormalize(const float n[3], const double sum[3], float tangent[3])
{
    double t[3], dot = n[0] * sum[0] + n[1] * sum[1] + n[2] * sum[2], length = 0;
    for (int k = 0; k < 3; k++) {
        t[k] = sum[k] - dot * n[k];
        length += t[k] * t[k];
    }
    if (!(length > 1e-12)) {
        int least = fabsf(n[0]) < fabsf(n[1]) ? 0 : 1;
        least = fabsf(n[2]) < fabsf(n[least]) ? 2 : least;
        length = 0;
        for (int k = 0; k < 3; k++) {
            t[k] = (k == least) - (double)n[least] * n[k];
            length += t[k] * t[k];
        }
    }
    for (int k = 0; k < 3; k++)
        tangent[k] = (float)(t[k] / sqrt(length));
}

void psc_geometry_make_tangents(struct geometry *g)
{
    uint32_t before = g->vertex_count;
    /* Per vertex and side. */
    double(*sums)[2][3] = pen_alloc(before, sizeof *sums);
    bool(*used)[2] = pen_alloc(before, sizeof *used);
    memset(sums, 0, before * sizeof *sums);
    memset(used, 0, before * sizeof *used);
    for (uint32_t i = 0; i < g->index_count; i += 3) {
        double tangent[3];
        int side;
        if (!triangle_tangent(g, &g->indices[i], tangent, &side))
            continue;
        for (int c = 0; c < 3; c++) {
            uint32_t v = g->indices[i + c];
            double weight = corner_angle(g, &g->indices[i], c);
            for (int k = 0; k < 3; k++)
                sums[v][side][k] += weight * tangent[k];
            used[v][side] = true;
        }
    }

    /* A vertex on the seam between mirrored halves gets a twin for the mirrored one. */
    uint32_t *twins = pen_alloc(before, sizeof *twins);
    for (uint32_t v = 0; v < before; v++)
        twins[v] = used[v][0] && used[v][1] ? copy_vertex(g, v) : v;
    for (uint32_t i = 0; g->vertex_count > before && i < g->index_count; i += 3) {
        double tangent[3];
        int side;
        if (triangle_tangent(g, &g->indices[i], tangent, &side) && side)
            for (int c = 0; c < 3; c++)
                g->indices[i + c] = twins[g->indices[i + c]];
    }

    g->tangents = pen_alloc(g->vertex_count, sizeof *g->tangents);
    for (uint32_t v = 0; v < before; v++) {
        int side = used[v][0] ? 0 : used[v][1];
        orthonormalize(g->normals[v], sums[v][side], g->tangents[v]);
        g->tangents[v][3] = side ? -1 : 1;
        if (twins[v] == v)
            continue;
        orthonormalize(g->normals[v], sums[v][1], g->tangents[twins[v]]);
        g->tangents[twins[v]][3] = -1;
    }
    free(twins);
    free(used);
    free(sums);
}
