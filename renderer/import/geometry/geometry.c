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
