/* From a caller's mesh to checked arrays of our own. */
#include "protocol/memory.h"
#include "renderer/blob/geometry.h"
#include "renderer/blob/check.h"
#include <stdlib.h>

#define FARTHEST 1e12f /* m; squares and sums of such coordinates stay finite in float */

bool psc_triangle_normal(const float a[3], const float b[3], const float c[3], double normal[3])
{
    double e[3], f[3];
    for (int k = 0; k < 3; k++) {
        e[k] = (double)b[k] - a[k];
        f[k] = (double)c[k] - a[k];
    }
    double n[3] = {e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]};
    double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int k = 0; k < 3; k++)
        normal[k] = length > 0 ? n[k] / length : 0;
    return length > 0;
}

static bool check_mesh(const struct psc_mesh *mesh, struct pen_error *error)
{
    if (mesh->index_count % 3)
        return pen_fail(error, PEN_INVALID, "", "A mesh has %u indices, not a multiple of 3.",
            mesh->index_count);
    if (!mesh->indices && mesh->index_count > mesh->vertex_count)
        return pen_fail(error, PEN_INVALID, "", "A mesh has fewer vertices than corners.");
    for (uint32_t i = 0; mesh->indices && i < mesh->index_count; i++)
        if (mesh->indices[i] >= mesh->vertex_count)
            return pen_fail(error, PEN_INVALID, "", "Index %u of a mesh of %u vertices.",
                mesh->indices[i], mesh->vertex_count);
    for (uint32_t i = 0; i < mesh->vertex_count; i++)
        for (int k = 0; k < 3; k++)
            if (!(fabsf(mesh->positions[i][k]) <= FARTHEST))
                return pen_fail(error, PEN_INVALID, "",
                    "A vertex position is not finite or is farther than 1e12 m from the origin.");
    uint64_t triangles = 0;
    for (uint32_t i = 0; mesh->meshlet_triangles && i < mesh->meshlet_count; i++) {
        uint32_t n = mesh->meshlet_triangles[i];
        if (!n || n > PSC_MESHLET_TRIANGLES)
            return pen_fail(error, PEN_INVALID, "", "A meshlet of %u triangles.", n);
        triangles += n;
    }
    if (mesh->meshlet_triangles && triangles * 3 != mesh->index_count)
        return pen_fail(error, PEN_INVALID, "", "Meshlets do not cover their mesh.");
    return true;
}

static float finite_or_zero(float x)
{
    return all_finite(&x, 1) ? x : 0;
}

static uint8_t unorm8(float x)
{
    return x >= 1 ? 255 : x > 0 ? (uint8_t)(x * 255 + 0.5f) : 0;
}

/* Scales v to length 1 in place; false when it has no direction. */
static bool normalize3(float v[3])
{
    double length = sqrt((double)v[0] * v[0] + (double)v[1] * v[1] + (double)v[2] * v[2]);
    if (!(length > 1e-30 && length < 1e300))
        return false;
    for (int k = 0; k < 3; k++)
        v[k] = (float)(v[k] / length);
    return true;
}

/* A caller's normals and tangents may be unnormalised, zero or not finite; ours are unit. A vertex
 * without a usable normal takes its last triangle's. */
static void normalize_normals(struct geometry *g)
{
    bool *missing = NULL;
    for (uint32_t i = 0; i < g->vertex_count; i++) {
        if (normalize3(g->normals[i]))
            continue;
        if (!missing)
            missing = memset(pen_alloc(g->vertex_count, sizeof *missing), 0, g->vertex_count);
        missing[i] = true;
        memcpy(g->normals[i], (float[3]){0, 1, 0}, sizeof g->normals[i]);
    }
    for (uint32_t i = 0; missing && i < g->index_count; i += 3) {
        const uint32_t *t = &g->indices[i];
        double n[3];
        if (!psc_triangle_normal(g->positions[t[0]], g->positions[t[1]], g->positions[t[2]], n))
            continue;
        for (int c = 0; c < 3; c++)
            for (int k = 0; missing[t[c]] && k < 3; k++)
                g->normals[t[c]][k] = (float)n[k];
    }
    free(missing);
}

static void normalize_tangents(struct geometry *g)
{
    for (uint32_t i = 0; i < g->vertex_count; i++) {
        float *t = g->tangents[i];
        t[3] = t[3] < 0 ? -1 : 1;
        if (!normalize3(t)) { /* any direction across the normal */
            const float *n = g->normals[i];
            bool x = fabsf(n[0]) < 0.9f;
            float across[3] = {x ? 0 : -n[2], x ? n[2] : 0, x ? -n[1] : n[0]};
            memcpy(t, across, sizeof across);
            normalize3(t);
        }
    }
}

static void flat_normals(struct geometry *g)
{
    for (uint32_t i = 0; i < g->index_count; i += 3) {
        double n[3];
        if (!psc_triangle_normal(g->positions[i], g->positions[i + 1], g->positions[i + 2], n))
            n[1] = 1;
        for (int c = 0; c < 3; c++)
            for (int k = 0; k < 3; k++)
                g->normals[i + c][k] = (float)n[k];
    }
}

/* Primitives cut from one large vertex buffer name few of its vertices: the others are left behind.
 */
static void choose_vertices(struct geometry *g, const struct psc_mesh *mesh)
{
    g->index_count = mesh->index_count;
    g->indices = pen_alloc(g->index_count, sizeof *g->indices);
    if (!mesh->normals) { /* flat: every corner is a vertex of its own */
        g->vertex_count = mesh->index_count;
        g->sources = pen_alloc(g->vertex_count, sizeof *g->sources);
        for (uint32_t i = 0; i < g->index_count; i++) {
            g->sources[i] = mesh->indices ? mesh->indices[i] : i;
            g->indices[i] = i;
        }
        return;
    }
    uint32_t *ours = pen_alloc(mesh->vertex_count, sizeof *ours);
    memset(ours, 0, mesh->vertex_count * sizeof *ours);
    for (uint32_t i = 0; i < g->index_count; i++)
        ours[mesh->indices ? mesh->indices[i] : i] = 1;
    g->sources = pen_alloc(mesh->vertex_count, sizeof *g->sources);
    for (uint32_t v = 0; v < mesh->vertex_count; v++)
        if (ours[v]) {
            ours[v] = g->vertex_count;
            g->sources[g->vertex_count++] = v;
        }
    for (uint32_t i = 0; i < g->index_count; i++)
        g->indices[i] = ours[mesh->indices ? mesh->indices[i] : i];
    free(ours);
}

bool psc_geometry_create(struct geometry *g, const struct psc_mesh *mesh, struct pen_error *error)
{
    memset(g, 0, sizeof *g);
    if (!check_mesh(mesh, error))
        return false;
    choose_vertices(g, mesh);
    uint32_t n = g->vertex_capacity = g->vertex_count;
    g->positions = pen_alloc(n, sizeof *g->positions);
    g->normals = pen_alloc(n, sizeof *g->normals);
    g->uv = pen_alloc(n, sizeof *g->uv);
    g->colors = pen_alloc(n, sizeof *g->colors);
    if (mesh->tangents && mesh->normals) /* given tangents belong to given normals */
        g->tangents = pen_alloc(n, sizeof *g->tangents);

    for (uint32_t i = 0; i < n; i++) {
        uint32_t from = g->sources[i];
        memcpy(g->positions[i], mesh->positions[from], sizeof g->positions[i]);
        if (mesh->normals)
            memcpy(g->normals[i], mesh->normals[from], sizeof g->normals[i]);
        if (g->tangents)
            memcpy(g->tangents[i], mesh->tangents[from], sizeof g->tangents[i]);
        for (int k = 0; k < 2; k++) {
            g->uv[i][0][k] = mesh->uv0 ? finite_or_zero(mesh->uv0[from][k]) : 0;
            g->uv[i][1][k] = mesh->uv1 ? finite_or_zero(mesh->uv1[from][k]) : 0;
        }
        for (int k = 0; k < 4; k++)
            g->colors[i][k] = mesh->colors ? unorm8(mesh->colors[from][k]) : 255;
    }

    if (!mesh->normals)
        flat_normals(g);
    else
        normalize_normals(g);
    if (g->tangents)
        normalize_tangents(g);
    else if (mesh->normal_map && (mesh->normal_map->uv_set & 1 ? mesh->uv1 : mesh->uv0))
        psc_geometry_make_tangents(g, mesh->normal_map);
    return true;
}

void psc_geometry_finish(struct geometry *g)
{
    free(g->positions);
    free(g->normals);
    free(g->tangents);
    free(g->uv);
    free(g->colors);
    free(g->sources);
    free(g->indices);
    memset(g, 0, sizeof *g);
}
