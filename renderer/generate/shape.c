#include "renderer/generate/shape.h"
#include "protocol/memory.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

void shape_finish(struct shape *s)
{
    free(s->positions);
    free(s->normals);
    free(s->uv);
    free(s->indices);
    memset(s, 0, sizeof *s);
}

void shape_reserve(struct shape *s, uint32_t vertices, uint32_t indices)
{
    if (vertices > s->vertex_capacity - s->vertex_count) {
        uint32_t n = s->vertex_capacity = s->vertex_count + vertices + s->vertex_count / 2 + 64;
        s->positions = pen_realloc_array(s->positions, n, sizeof *s->positions);
        s->normals = pen_realloc_array(s->normals, n, sizeof *s->normals);
        s->uv = pen_realloc_array(s->uv, n, sizeof *s->uv);
    }
    s->indices =
        pen_grow(s->indices, &s->index_capacity, s->index_count + indices, sizeof *s->indices);
}

uint32_t shape_vertex(
    struct shape *s, const double position[3], const double normal[3], double u, double v)
{
    shape_reserve(s, 1, 0);
    uint32_t i = s->vertex_count++;
    for (int k = 0; k < 3; k++) {
        s->positions[i][k] = (float)position[k];
        s->normals[i][k] = (float)normal[k];
    }
    s->uv[i][0] = (float)u;
    s->uv[i][1] = (float)v;
    return i;
}

static bool coincide(const float a[3], const float b[3])
{
    return fabsf(a[0] - b[0]) + fabsf(a[1] - b[1]) + fabsf(a[2] - b[2]) < 1e-8f;
}

/* Triangles that a pole collapses are left out. */
void shape_triangle(struct shape *s, uint32_t a, uint32_t b, uint32_t c)
{
    if (coincide(s->positions[a], s->positions[b]) || coincide(s->positions[b], s->positions[c]) ||
        coincide(s->positions[c], s->positions[a]))
        return;
    shape_reserve(s, 0, 3);
    uint32_t *t = &s->indices[s->index_count];
    t[0] = a;
    t[1] = b;
    t[2] = c;
    s->index_count += 3;
}

void cross3(const double a[3], const double b[3], double c[3])
{
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

double normalize3(double v[3])
{
    double length = sqrt(dot3(v, v));
    if (!(length > 0)) {
        v[0] = v[2] = 0;
        v[1] = 1;
        return 0;
    }
    for (int k = 0; k < 3; k++)
        v[k] /= length;
    return length;
}

void any_perpendicular(const double n[3], double p[3])
{
    const double x[3] = {1, 0, 0}, y[3] = {0, 1, 0};
    cross3(n, fabs(n[0]) < 0.8 ? x : y, p);
    normalize3(p);
}

void shape_quad(struct shape *s, const double a[3], const double b[3], const double c[3],
    const double d[3], double width, double height)
{
    double e[3], f[3], n[3];
    for (int k = 0; k < 3; k++) {
        e[k] = c[k] - a[k];
        f[k] = d[k] - b[k];
    }
    cross3(e, f, n);
    normalize3(n);
    uint32_t first = shape_vertex(s, a, n, 0, height);
    shape_vertex(s, b, n, width, height);
    shape_vertex(s, c, n, width, 0);
    shape_vertex(s, d, n, 0, 0);
    shape_triangle(s, first, first + 1, first + 2);
    shape_triangle(s, first, first + 2, first + 3);
}

static void surface_normal(
    shape_point *point, const void *context, double u, double v, double normal[3])
{
    const double h = 1e-5;
    /* At a pole dP/du vanishes: look a little inside. */
    for (int attempt = 0; attempt < 2; attempt++) {
        double a[3], b[3], c[3], d[3];
        point(context, u - h, v, a);
        point(context, u + h, v, b);
        point(context, u, v - h < 0 ? v : v - h, c);
        point(context, u, v + h > 1 ? v : v + h, d);
        for (int k = 0; k < 3; k++) {
            b[k] -= a[k];
            d[k] -= c[k];
        }
        cross3(b, d, normal);
        if (normalize3(normal) > 1e-14)
            return;
        v = v < 0.5 ? v + 1e-3 : v - 1e-3;
    }
}

void shape_surface(struct shape *s, uint32_t nu, uint32_t nv, double width, double height,
    shape_point *point, const void *context)
{
    const uint32_t block = 8, row = nu + 1, first = s->vertex_count;
    shape_reserve(s, row * (nv + 1), 6 * nu * nv);
    for (uint32_t j = 0; j <= nv; j++)
        for (uint32_t i = 0; i <= nu; i++) {
            double u = (double)i / nu, v = (double)j / nv, p[3], n[3];
            point(context, u, v, p);
            surface_normal(point, context, u, v, n);
            shape_vertex(s, p, n, u * width, (1 - v) * height);
        }
    for (uint32_t j0 = 0; j0 < nv; j0 += block)
        for (uint32_t i0 = 0; i0 < nu; i0 += block)
            for (uint32_t j = j0; j < j0 + block && j < nv; j++)
                for (uint32_t i = i0; i < i0 + block && i < nu; i++) {
                    uint32_t a = first + j * row + i;
                    shape_triangle(s, a, a + 1, a + row + 1);
                    shape_triangle(s, a, a + row + 1, a + row);
                }
}

static double distance3(const double a[3], const double b[3])
{
    return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) +
                (a[2] - b[2]) * (a[2] - b[2]));
}

void shape_block(struct shape *s, const double c[8][3])
{
    static const uint8_t faces[6][4] = {
        {3, 2, 6, 7}, {2, 1, 5, 6}, {1, 0, 4, 5}, {0, 3, 7, 4}, {7, 6, 5, 4}, {0, 1, 2, 3}};
    for (int f = 0; f < 6; f++) {
        const uint8_t *q = faces[f];
        shape_quad(s, c[q[0]], c[q[1]], c[q[2]], c[q[3]], distance3(c[q[0]], c[q[1]]),
            distance3(c[q[1]], c[q[2]]));
    }
}

void shape_box(struct shape *s, const double low[3], const double high[3])
{
    double c[8][3];
    for (int i = 0; i < 8; i++) {
        c[i][0] = (i & 3) == 1 || (i & 3) == 2 ? high[0] : low[0];
        c[i][1] = i & 4 ? high[1] : low[1];
        c[i][2] = (i & 3) >= 2 ? high[2] : low[2];
    }
    shape_block(s, c);
}

struct profile {
    const double (*points)[3];
    uint32_t count;
};

/* Catmull-Rom through the points, whose ends are doubled by reflection. */
static void profile_point(const void *context, double u, double v, double point[3])
{
    const struct profile *p = context;
    double at = v * (p->count - 1), radius_height[2];
    uint32_t i = at >= p->count - 1 ? p->count - 2 : (uint32_t)at;
    double t = at - i;
    for (int k = 0; k < 2; k++) {
        double b = p->points[i][k], c = p->points[i + 1][k];
        double a = i ? p->points[i - 1][k] : 2 * b - c;
        double d = i + 2 < p->count ? p->points[i + 2][k] : 2 * c - b;
        radius_height[k] =
            t == 1 ? c
                   : b + 0.5 * t *
                             (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)));
    }
    double angle = 2 * M_PI * u, r = fmax(radius_height[0], 0);
    /* The seam closes exactly. */
    point[0] = u == 1 ? r : r * cos(angle);
    point[1] = radius_height[1];
    point[2] = u == 1 ? 0 : -r * sin(angle);
}

void shape_lathe(struct shape *s, const double (*profile)[3], uint32_t count, uint32_t steps,
    uint32_t sides, double width, double height)
{
    for (uint32_t begin = 0; begin + 1 < count;) {
        uint32_t end = begin + 1;
        while (end + 1 < count && profile[end][2] == 0)
            end++;
        struct profile part = {profile + begin, end - begin + 1};
        shape_surface(s, sides, end - begin == 1 ? 1 : steps * (end - begin), width, height,
            profile_point, &part);
        begin = end;
    }
}

static void transform(
    struct shape *s, uint32_t first, const double axes[3][3], double scale, const double origin[3])
{
    for (uint32_t i = first; i < s->vertex_count; i++) {
        float *p = s->positions[i], *n = s->normals[i], q[3], m[3];
        for (int k = 0; k < 3; k++) {
            q[k] = (float)(origin[k] +
                           scale * (p[0] * axes[0][k] + p[1] * axes[1][k] + p[2] * axes[2][k]));
            m[k] = (float)(n[0] * axes[0][k] + n[1] * axes[1][k] + n[2] * axes[2][k]);
        }
        memcpy(p, q, sizeof q);
        memcpy(n, m, sizeof m);
    }
}

void shape_move(
    struct shape *s, uint32_t first, double x, double y, double z, double turn_deg, double scale)
{
    double c = cos(turn_deg * M_PI / 180), d = sin(turn_deg * M_PI / 180);
    const double axes[3][3] = {{c, 0, -d}, {0, 1, 0}, {d, 0, c}}, origin[3] = {x, y, z};
    transform(s, first, axes, scale, origin);
}

void shape_stand(struct shape *s, uint32_t first, const double origin[3], const double axis[3])
{
    double axes[3][3];
    memcpy(axes[1], axis, sizeof axes[1]);
    normalize3(axes[1]);
    any_perpendicular(axes[1], axes[0]);
    cross3(axes[0], axes[1], axes[2]);
    transform(s, first, axes, 1, origin);
}

void shape_tube(
    struct shape *s, const double (*points)[3], const double *radii, uint32_t count, uint32_t sides)
{
    uint32_t first = s->vertex_count;
    shape_reserve(s, count * (sides + 1), 6 * sides * (count - 1));
    double side[3] = {0}, length = 0;
    for (uint32_t i = 0; i < count; i++) {
        double along[3], up[3];
        for (int k = 0; k < 3; k++)
            along[k] = points[i + 1 < count ? i + 1 : i][k] - points[i ? i - 1 : i][k];
        normalize3(along);
        if (i == 0) {
            any_perpendicular(along, side);
        } else { /* carried along without twist */
            double d = dot3(side, along);
            for (int k = 0; k < 3; k++)
                side[k] -= d * along[k];
            normalize3(side);
            length += distance3(points[i], points[i - 1]);
        }
        cross3(along, side, up);
        for (uint32_t j = 0; j <= sides; j++) {
            double angle = 2 * M_PI * (j % sides) / sides, c = cos(angle), d = sin(angle);
            double p[3], n[3];
            for (int k = 0; k < 3; k++) {
                n[k] = c * side[k] + d * up[k];
                p[k] = points[i][k] + radii[i] * n[k];
            }
            shape_vertex(s, p, n, (double)j / sides, 1 - length);
        }
    }
    for (uint32_t i = 0; i + 1 < count; i++)
        for (uint32_t j = 0; j < sides; j++) {
            uint32_t a = first + i * (sides + 1) + j, b = a + sides + 1;
            shape_triangle(s, a, a + 1, b + 1);
            shape_triangle(s, a, b + 1, b);
        }
}

static uint32_t dice_roll(struct dice *dice)
{
    uint64_t old = dice->state;
    dice->state = old * 6364136223846793005u + 1442695040888963407u;
    uint32_t mixed = (uint32_t)((old >> 18 ^ old) >> 27), turn = (uint32_t)(old >> 59);
    return mixed >> turn | mixed << (-turn & 31);
}

struct dice dice_seed(uint64_t seed)
{
    struct dice dice = {seed * 0x9e3779b97f4a7c15u + 0x853c49e6748fea9bu};
    dice_roll(&dice);
    dice_roll(&dice);
    return dice;
}

double dice_uniform(struct dice *dice, double low, double high)
{
    return low + (high - low) * (dice_roll(dice) / 4294967296.0);
}

void dice_direction(struct dice *dice, double v[3])
{
    double angle = dice_uniform(dice, 0, 2 * M_PI), y = dice_uniform(dice, -1, 1);
    double r = sqrt(1 - y * y);
    v[0] = r * cos(angle);
    v[1] = y;
    v[2] = r * sin(angle);
}
