/* Column, arch, wall and round things of the demo. */
#include "renderer/generate/demo.h"
#include "renderer/generate/model.h"
#include <math.h>

struct shaft {
    double low, high, radius;
};

/* Twenty flutes with sharp edges between them that fade at both ends, and a slight entasis. */
static void shaft_point(const void *context, double u, double v, double p[3])
{
    const struct shaft *s = context;
    double angle = 2 * M_PI * (u == 1 ? 0 : u);
    double ends = fmin(1, fmin(v, 1 - v) * 14), taper = 1 - 0.16 * pow(v < 0 ? 0 : v, 1.5);
    double flute = sqrt(fabs(sin(10 * angle))) * ends * (2 - ends);
    double r = s->radius * taper * (1 - 0.075 * flute);
    p[0] = r * cos(angle);
    p[1] = s->low + v * (s->high - s->low);
    p[2] = -r * sin(angle);
}

void shape_column(struct shape *s, double height, double radius, double detail)
{
    double d = fmax(detail, 0);
    uint32_t sides = (uint32_t)fmax(40 * d, 6), steps = (uint32_t)fmax(3 * d, 1);
    uint32_t around = (uint32_t)fmax(120 * d, 8), up = (uint32_t)fmax(12 * d, 2);
    double r = radius, base = 0.62 * r, top = height - 0.75 * r;
    shape_box(s, (double[]){-1.45 * r, 0, -1.45 * r}, (double[]){1.45 * r, 0.2 * r, 1.45 * r});
    const double foot[][3] = {{0, 0.2 * r, 1}, {1.28 * r, 0.2 * r, 1}, {1.40 * r, 0.28 * r, 0},
        {1.28 * r, 0.36 * r, 1}, {1.17 * r, 0.37 * r, 1}, {1.13 * r, 0.42 * r, 0},
        {1.19 * r, 0.47 * r, 1}, {1.23 * r, 0.53 * r, 0}, {1.13 * r, base, 1}, {0, base, 1}};
    shape_lathe(s, foot, 10, steps, sides, 3, 0.3);
    struct shaft shaft = {base, top, r};
    shape_surface(s, around, up, 6 * r, height, shaft_point, &shaft);
    double e = 0.84 * r;
    const double head[][3] = {{0, top, 1}, {e, top, 1}, {1.10 * e, top + 0.03 * r, 0},
        {e, top + 0.08 * r, 1}, {1.02 * e, top + 0.22 * r, 0}, {1.32 * e, top + 0.42 * r, 0},
        {1.50 * e, top + 0.48 * r, 1}, {1.50 * e, top + 0.53 * r, 1}, {0, top + 0.53 * r, 1}};
    shape_lathe(s, head, 9, steps, sides, 3, 0.3);
    shape_box(s, (double[]){-1.35 * r, top + 0.53 * r, -1.35 * r},
        (double[]){1.35 * r, height, 1.35 * r});
}

void shape_wall(struct shape *s, double length, double height, double depth, uint64_t seed)
{
    struct dice dice = dice_seed(seed);
    const double cap = 0.07, joint = 0.005;
    double body = height - cap;
    uint32_t courses = (uint32_t)(body / 0.19 + 0.5);
    shape_box(s, (double[]){0.02, 0, 0.02 - depth / 2},
        (double[]){length - 0.02, body, depth / 2 - 0.02});
    for (uint32_t c = 0; c < courses; c++) {
        double y = body * c / courses, x = 0;
        while (x < length - 1e-6) {
            double next = x + dice_uniform(&dice, 0.26, 0.5);
            if (next > length - 0.22)
                next = length;
            double out = dice_uniform(&dice, -0.007, 0.007);
            shape_box(s, (double[]){x + joint, y + joint, -depth / 2 - out},
                (double[]){next - joint, y + body / courses - joint, depth / 2 + out});
            x = next;
        }
    }
    uint32_t slabs = (uint32_t)fmax(length / 0.62, 1);
    for (uint32_t i = 0; i < slabs; i++)
        shape_box(s, (double[]){length * i / slabs + 0.002, body, -depth / 2 - 0.035},
            (double[]){length * (i + 1) / slabs - 0.002, height, depth / 2 + 0.035});
}

static void pier(struct shape *s, double x, double height, double width, double depth)
{
    uint32_t courses = (uint32_t)(height / 0.28 + 0.5);
    double w = width / 2, d = depth / 2, e = 0.006;
    shape_box(
        s, (double[]){x - w + 0.015, 0, 0.015 - d}, (double[]){x + w - 0.015, height, d - 0.015});
    for (uint32_t c = 0; c < courses; c++)
        shape_box(s, (double[]){x - w, height * c / courses + e, -d},
            (double[]){x + w, height * (c + 1) / courses - e, d});
    shape_box(s, (double[]){x - w - 0.04, 0, -d - 0.04}, (double[]){x + w + 0.04, 0.10, d + 0.04});
    shape_box(s, (double[]){x - w - 0.035, height - 0.07, -d - 0.035},
        (double[]){x + w + 0.035, height, d + 0.035});
}

void shape_arch(struct shape *s, double span, double spring, double depth)
{
    const uint32_t stones = 13;
    const double width = 0.30, inner = span / 2, outer = inner + width, gap = 0.006;
    pier(s, -inner - width / 2, spring, width, depth);
    pier(s, inner + width / 2, spring, width, depth);
    for (uint32_t i = 0; i < stones; i++) {
        double a = M_PI * i / stones + gap / inner, b = M_PI * (i + 1) / stones - gap / inner;
        bool key = i == stones / 2;
        double low = key ? inner - 0.03 : inner, high = key ? outer + 0.05 : outer;
        double d = (key ? depth + 0.05 : depth) / 2;
        /* Seen along the stone's own radius: "below" is the inside of the arch. */
        const double corners[8][3] = {{low * cos(b), spring + low * sin(b), -d},
            {low * cos(a), spring + low * sin(a), -d}, {low * cos(a), spring + low * sin(a), d},
            {low * cos(b), spring + low * sin(b), d}, {high * cos(b), spring + high * sin(b), -d},
            {high * cos(a), spring + high * sin(a), -d}, {high * cos(a), spring + high * sin(a), d},
            {high * cos(b), spring + high * sin(b), d}};
        shape_block(s, corners);
    }
}

static void sphere_point(const void *context, double u, double v, double p[3])
{
    double radius = *(const double *)context, a = 2 * M_PI * (u == 1 ? 0 : u);
    double r = v == 0 || v == 1 ? 0 : radius * sin(M_PI * v);
    p[0] = r * cos(a);
    p[1] = -radius * cos(M_PI * v);
    p[2] = -r * sin(a);
}

void shape_sphere(struct shape *s, double radius, uint32_t rows)
{
    shape_surface(s, 2 * rows, rows, 4, 2, sphere_point, &radius);
}

struct knot {
    double size, thickness;
};

static void knot_centre(double t, double size, double p[3])
{
    double r = size * (0.68 + 0.32 * cos(3 * t));
    p[0] = r * cos(2 * t);
    p[1] = size * 0.36 * sin(3 * t);
    p[2] = -r * sin(2 * t);
}

static void knot_point(const void *context, double u, double v, double p[3])
{
    const struct knot *knot = context;
    double t = 2 * M_PI * (u == 1 ? 0 : u), a = -2 * M_PI * (v == 1 ? 0 : v), h = 1e-4;
    double before[3], after[3], at[3], along[3], out[3], side[3];
    knot_centre(t - h, knot->size, before);
    knot_centre(t + h, knot->size, after);
    knot_centre(t, knot->size, at);
    /* Away from the torus' core circle, which the curve winds around. */
    const double core[3] = {0.68 * knot->size * cos(2 * t), 0, -0.68 * knot->size * sin(2 * t)};
    for (int k = 0; k < 3; k++) {
        along[k] = after[k] - before[k];
        out[k] = at[k] - core[k];
    }
    normalize3(along);
    double d = dot3(out, along);
    for (int k = 0; k < 3; k++)
        out[k] -= d * along[k];
    normalize3(out);
    cross3(along, out, side);
    for (int k = 0; k < 3; k++)
        p[k] = at[k] + knot->thickness * (cos(a) * out[k] + sin(a) * side[k]);
}

void shape_knot(struct shape *s, double size, double thickness)
{
    struct knot knot = {size, thickness};
    shape_surface(s, 320, 20, 24, 1, knot_point, &knot);
}
