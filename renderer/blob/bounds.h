/* Bounds of instances and meshlets: for the builder, and for who moves vertices. */
#pragma once
#include "renderer/blob/pscene.h"

/* World bounds over instances. Clear: min > max. `tight`: around the vertices, else around the
 * corners of the primitive's box. */
void psc_bounds_clear(float min[3], float max[3]);
void psc_bounds_grow(
    const struct psc_scene *scene, uint32_t instance, bool tight, float min[3], float max[3]);
void psc_bounds_grow_points(
    const float world[12], const float (*points)[3], uint32_t count, float min[3], float max[3]);

/* Where to count the coordinates of what lies in a box from, so that single precision resolves them:
 * 0 when the world's own origin is near, else the box's centre, rounded to about its size, so that
 * equal places mostly give equal origins. */
void psc_choose_origin(const double min[3], const double max[3], double origin[3]);

/* Bounding sphere and normal cone of the triangles in m's index range; conservative. */
void psc_meshlet_bound(struct psc_meshlet *m, const float (*positions)[3], const uint32_t *indices);
/* Unit normal in double precision; false for a triangle without area. */
bool psc_triangle_normal(const float a[3], const float b[3], const float c[3], double normal[3]);
