#include "renderer/blob/geometry.h"
#include <math.h>

/* Bounding sphere around the middle of the box, with the rounding of the stored floats on top. */
static void bound_sphere(
    struct psc_meshlet *m, const float (*positions)[3], const uint32_t *indices)
{
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (uint32_t i = 0; i < m->index_count; i++)
        for (int k = 0; k < 3; k++) {
            low[k] = fmin(low[k], positions[indices[i]][k]);
            high[k] = fmax(high[k], positions[indices[i]][k]);
        }
    for (int k = 0; k < 3; k++)
        m->center[k] = (float)((low[k] + high[k]) / 2);
    double farthest = 0;
    for (uint32_t i = 0; i < m->index_count; i++) {
        double square = 0;
        for (int k = 0; k < 3; k++) {
            double d = (double)positions[indices[i]][k] - m->center[k];
            square += d * d;
        }
        farthest = fmax(farthest, square);
    }
    m->radius = nextafterf((float)sqrt(farthest), INFINITY);
}

/* With every normal within the angle a of the axis, v is at most 90 degrees from every normal when
 * it is within 90 - a of the axis: dot(v, axis) >= sin a. For an eye at distance d of the centre of
 * a sphere of radius r, dot(v, axis) >= sin a + r/d gives dot(v, normal) >= r/d for every normal,
 * which is what the farthest point of the sphere needs. */
static void bound_cone(struct psc_meshlet *m, const float (*positions)[3], const uint32_t *indices)
{
    double sum[3] = {0}, n[3];
    for (uint32_t i = 0; i < m->index_count; i += 3) {
        const uint32_t *t = &indices[i];
        psc_triangle_normal(positions[t[0]], positions[t[1]], positions[t[2]], n);
        for (int k = 0; k < 3; k++)
            sum[k] += n[k];
    }
    double length = sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
    m->cone_axis[0] = m->cone_axis[1] = 0;
    m->cone_axis[2] = 1;
    m->cone_cutoff = 2;
    if (!(length > 1e-6))
        return;
    for (int k = 0; k < 3; k++)
        m->cone_axis[k] = (float)(sum[k] / length);
    double least = 1; /* cosine of the widest angle */
    for (uint32_t i = 0; i < m->index_count; i += 3) {
        const uint32_t *t = &indices[i];
        if (psc_triangle_normal(positions[t[0]], positions[t[1]], positions[t[2]], n))
            least = fmin(
                least, n[0] * m->cone_axis[0] + n[1] * m->cone_axis[1] + n[2] * m->cone_axis[2]);
    }
    if (least > 0.01) /* the margin covers a reader's single precision */
        m->cone_cutoff = (float)(sqrt(fmax(0, 1 - least * least)) + 1e-4);
}

void psc_meshlet_bound(struct psc_meshlet *m, const float (*positions)[3], const uint32_t *indices)
{
    bound_sphere(m, positions, indices);
    bound_cone(m, positions, indices);
}
