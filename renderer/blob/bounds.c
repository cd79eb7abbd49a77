#include "renderer/blob/bounds.h"
#include <float.h>
#include <math.h>

void psc_bounds_clear(float min[3], float max[3])
{
    for (int k = 0; k < 3; k++) {
        min[k] = FLT_MAX;
        max[k] = -FLT_MAX;
    }
}

static void grow(const float m[12], const float p[3], float min[3], float max[3])
{
    for (int k = 0; k < 3; k++) {
        const float *row = m + 4 * k;
        float w = (float)((double)row[0] * (double)p[0] + (double)row[1] * (double)p[1] +
                          (double)row[2] * (double)p[2] + (double)row[3]);
        min[k] = fminf(min[k], w);
        max[k] = fmaxf(max[k], w);
    }
}

void psc_bounds_grow_points(
    const float world[12], const float (*points)[3], uint32_t count, float min[3], float max[3])
{
    for (uint32_t i = 0; i < count; i++)
        grow(world, points[i], min, max);
}

void psc_bounds_grow(
    const struct psc_scene *scene, uint32_t instance, bool tight, float min[3], float max[3])
{
    const float *world = scene->instances[instance].world;
    const struct psc_primitive *p = &scene->primitives[scene->instances[instance].primitive];
    if (tight)
        psc_bounds_grow_points(
            world, scene->positions + p->first_vertex, p->vertex_count, min, max);
    for (int c = 0; !tight && c < 8; c++) {
        const float corner[3] = {c & 1 ? p->bounds_max[0] : p->bounds_min[0],
            c & 2 ? p->bounds_max[1] : p->bounds_min[1],
            c & 4 ? p->bounds_max[2] : p->bounds_min[2]};
        grow(world, corner, min, max);
    }
}

/* Farther off than this many radii, single precision is coarse for what is drawn. */
#define NEAR_RADII 64

void psc_choose_origin(const double min[3], const double max[3], double origin[3])
{
    double away = 0, radius = 0;
    for (int k = 0; k < 3; k++) {
        origin[k] = (min[k] + max[k]) / 2;
        away += origin[k] * origin[k];
        radius += (max[k] - min[k]) * (max[k] - min[k]) / 4;
    }
    away = sqrt(away), radius = sqrt(radius);
    /* A point's size is nothing: what doubles still hold exactly has to do. */
    double step = exp2(floor(log2(fmax(radius, away * 0x1p-40))));
    for (int k = 0; k < 3; k++)
        origin[k] = away > NEAR_RADII * radius ? nearbyint(origin[k] / step) * step : 0;
}
