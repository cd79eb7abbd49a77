#include "renderer/import/geometry/geometry.h"
#include <stdlib.h>
#include <string.h>

void imp_geometry_finish(struct imp_geometry *g)
{
    free(g->positions);
    free(g->normals);
    free(g->tangents);
    free(g->uv[0]);
    free(g->uv[1]);
    free(g->colors);
    free(g->indices);
    free(g->meshlet_triangles);
    free(g->used);
    free(g->points);
    memset(g, 0, sizeof *g);
}

void imp_geometry_from_zero(struct imp_geometry *g)
{
    for (int k = 0; k < 3; k++) {
        for (uint32_t i = 0; i < g->vertex_count; i++)
            g->positions[i][k] += g->base[k];
        for (uint32_t i = 0; i < g->point_count; i++)
            g->points[i][k] += g->base[k];
        g->base[k] = 0;
    }
}
