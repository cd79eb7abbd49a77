/* Triangle meshes grown piece by piece, and the surfaces our scenes are made of. Metres, y up,
 * counter-clockwise front faces; texture v grows downwards, as in glTF. */
#pragma once
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct shape {
    float (*positions)[3];
    float (*normals)[3];
    float (*uv)[2];
    uint32_t vertex_count, vertex_capacity;
    uint32_t *indices;
    uint32_t index_count;
    size_t index_capacity;
};

void shape_finish(struct shape *shape);
void shape_reserve(struct shape *shape, uint32_t vertices, uint32_t indices);
uint32_t shape_vertex(
    struct shape *shape, const double position[3], const double normal[3], double u, double v);
void shape_triangle(struct shape *shape, uint32_t a, uint32_t b, uint32_t c);

/* Corners counter-clockwise from the lower left; flat; texture 0..width x 0..height. */
void shape_quad(struct shape *shape, const double a[3], const double b[3], const double c[3],
    const double d[3], double width, double height);

/* Point of a surface for u, v in 0..1. Front faces are where dP/du x dP/dv points. */
typedef void shape_point(const void *context, double u, double v, double point[3]);
/* nu x nv quads in blocks of 8 x 8, which are good meshlets; smooth normals by differences. */
void shape_surface(struct shape *shape, uint32_t nu, uint32_t nv, double width, double height,
    shape_point *point, const void *context);

/* Six flat faces between eight corners: 0 to 3 the bottom at (-x,-z), (+x,-z), (+x,+z), (-x,+z), 4
 * to 7 the top in the same order. Texture in metres. */
void shape_block(struct shape *shape, const double corners[8][3]);
void shape_box(struct shape *shape, const double low[3], const double high[3]);

/* Turns a profile (radius, height, sharp) about the y axis, from bottom to top on the outside.
 * Between sharp points the profile is a smooth curve with `steps` parts per span. */
void shape_lathe(struct shape *shape, const double (*profile)[3], uint32_t count, uint32_t steps,
    uint32_t sides, double width, double height);

/* A tube along points with a radius each. */
void shape_tube(struct shape *shape, const double (*points)[3], const double *radii, uint32_t count,
    uint32_t sides);

/* Turns every vertex from number `first` on by `turn_deg` about +y, scales and moves it. */
void shape_move(struct shape *shape, uint32_t first, double x, double y, double z, double turn_deg,
    double scale);
/* Turns them so that +y becomes `axis` and the origin `origin`. */
void shape_stand(struct shape *shape, uint32_t first, const double origin[3], const double axis[3]);

/* Small vectors. */
static inline double dot3(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
void cross3(const double a[3], const double b[3], double c[3]);
double normalize3(double v[3]); /* returns the old length; (0,1,0) when that is 0 */
void any_perpendicular(const double n[3], double p[3]); /* both unit */

/* Seeded random numbers (PCG, O'Neill 2014): the same everywhere. */
struct dice {
    uint64_t state;
};
struct dice dice_seed(uint64_t seed);
double dice_uniform(struct dice *dice, double low, double high);
void dice_direction(struct dice *dice, double v[3]); /* uniform on the unit sphere */
