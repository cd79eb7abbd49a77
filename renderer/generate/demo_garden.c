/* Tree, fence and globe of the demo: the thin casters. */
#include "renderer/generate/demo.h"
#include <math.h>
#include <stddef.h>
#include <string.h>

enum { KNOTS = 6, TWIG = 4 };

static void leaf_on(struct shape *s, struct dice *dice, const double at[3], const double along[3])
{
    double out[3], across[3], wild[3];
    dice_direction(dice, wild);
    for (int k = 0; k < 3; k++)
        out[k] = 0.35 * along[k] + wild[k];
    out[1] -= 0.15;
    normalize3(out);
    dice_direction(dice, wild);
    wild[1] *= 0.4; /* blades lie rather flat */
    cross3(out, wild, across);
    normalize3(across);
    double size = dice_uniform(dice, 0.085, 0.135), a[3], b[3], c[3], d[3];
    for (int k = 0; k < 3; k++) {
        a[k] = at[k] - 0.34 * size * across[k];
        b[k] = at[k] + 0.34 * size * across[k];
        c[k] = b[k] + size * out[k];
        d[k] = a[k] + size * out[k];
    }
    shape_quad(s, a, b, c, d, 1, 1);
}

/* A branch that wanders, then its children: nearer the tip they are shorter and more spread. */
static void branch(struct shape *wood, struct shape *leaves, struct dice *dice,
    const double from[3], const double direction[3], double length, double radius, int level)
{
    double points[KNOTS][3], radii[KNOTS], along[KNOTS][3], at[3], d[3];
    memcpy(at, from, sizeof at);
    memcpy(d, direction, sizeof d);
    for (int i = 0; i < KNOTS; i++) {
        double wild[3];
        memcpy(points[i], at, sizeof at);
        memcpy(along[i], d, sizeof d);
        radii[i] = radius * (1 - 0.42 * i / (KNOTS - 1.0));
        dice_direction(dice, wild);
        for (int k = 0; k < 3; k++)
            d[k] += (level ? 0.20 : 0.07) * wild[k];
        d[1] += level ? 0.06 : 0.02; /* towards the light */
        normalize3(d);
        for (int k = 0; k < 3; k++)
            at[k] += d[k] * length / (KNOTS - 1);
    }
    if (level == 0)
        radii[0] *= 1.45; /* roots */
    shape_tube(wood, (const double(*)[3])points, radii, KNOTS, level < 2 ? 12 - 3 * level : 5);

    if (level >= TWIG - 1)
        for (int i = 0; i < (level == TWIG ? 13 : 6); i++) {
            int k = 1 + (int)dice_uniform(dice, 0, KNOTS - 1);
            leaf_on(leaves, dice, points[k], along[k]);
        }
    if (level == TWIG)
        return;
    int children = level == 0 ? 6 : 4;
    double spin = dice_uniform(dice, 0, 2 * M_PI);
    for (int c = 0; c < children; c++) {
        bool leader = c == children - 1; /* carries on where the branch ends */
        int k = leader ? KNOTS - 1 : (level ? 2 : 3) + c % (KNOTS - (level ? 2 : 3));
        double tilt = leader ? 0.2 : dice_uniform(dice, 0.65, 1.15);
        double turn = spin + 2.399963 * c, side[3], up[3], e[3]; /* golden angle */
        any_perpendicular(along[k], side);
        cross3(along[k], side, up);
        for (int j = 0; j < 3; j++)
            e[j] = cos(tilt) * along[k][j] + sin(tilt) * (cos(turn) * side[j] + sin(turn) * up[j]);
        normalize3(e);
        double shrink = leader ? 0.72 : dice_uniform(dice, 0.52, 0.70);
        branch(wood, leaves, dice, points[k], e, length * shrink, radii[k] * (leader ? 0.95 : 0.68),
            level + 1);
    }
}

void shape_tree(struct shape *wood, struct shape *leaves, uint64_t seed)
{
    struct dice dice = dice_seed(seed);
    const double root[3] = {0, -0.02, 0}, up[3] = {0.04, 1, 0.02};
    branch(wood, leaves, &dice, root, up, 1.05, 0.075, 0);
}

void shape_fence(struct shape *s, double length, double height, double spacing)
{
    const double rail = 0.012, low = 0.14, high = height - 0.17;
    const double levels[2] = {low, high};
    for (int i = 0; i < 2; i++)
        shape_box(s, (double[]){0, levels[i] - rail, -0.007},
            (double[]){length, levels[i] + rail, 0.007});
    uint32_t bars = (uint32_t)(length / spacing + 0.5);
    for (uint32_t i = 0; i <= bars; i++) {
        bool post = i == 0 || i == bars || i == bars / 2;
        double r = post ? 0.018 : 0.008, top = post ? height - 0.06 : height - 0.10;
        /* A bar, a collar and a leaf-shaped point; a post ends in a ball. */
        const double bar[][3] = {{0, 0, 1}, {r, 0, 1}, {r, top, 1}, {1.9 * r, top, 1},
            {1.9 * r, top + 0.012, 1}, {0.7 * r, top + 0.012, 1}, {2.0 * r, top + 0.04, 0},
            {1.1 * r, top + 0.07, 0}, {0, height, 1}};
        const double ball[][3] = {{0, 0, 1}, {r, 0, 1}, {r, top, 1}, {1.2 * r, top, 1},
            {2.0 * r, top + 0.03, 0}, {1.2 * r, top + 0.06, 0}, {0, top + 0.068, 1}};
        uint32_t first = s->vertex_count;
        shape_lathe(s, post ? ball : bar, post ? 7 : 9, 3, post ? 12 : 8, 1, 1);
        shape_move(s, first, length * i / bars, 0, 0, 0, 1);
    }
}

struct ring {
    double radius, thickness;
};

static void ring_point(const void *context, double u, double v, double p[3])
{
    const struct ring *ring = context;
    double a = 2 * M_PI * (u == 1 ? 0 : u), b = 2 * M_PI * (v == 1 ? 0 : v);
    double r = ring->radius + ring->thickness * cos(b);
    p[0] = r * cos(a);
    p[1] = ring->thickness * sin(b);
    p[2] = -r * sin(a);
}

void shape_armillary(struct shape *s, double height, double radius)
{
    const double centre[3] = {0, height, 0}, tilt = 23.4 * M_PI / 180;
    const double pole[3] = {sin(tilt), cos(tilt), 0}, side[3] = {cos(tilt), -sin(tilt), 0};
    const double forward[3] = {0, 0, 1}, up[3] = {0, 1, 0};
    double oblique[3] = {pole[0], pole[1], 0.45};
    normalize3(oblique);
    const struct {
        const double *axis;
        struct ring ring;
    } rings[] = {{forward, {radius, 0.013}}, {up, {radius * 0.985, 0.016}},
        {pole, {radius * 0.94, 0.009}}, {side, {radius * 0.93, 0.009}},
        {oblique, {radius * 0.90, 0.012}}};
    for (size_t i = 0; i < sizeof rings / sizeof *rings; i++) {
        uint32_t first = s->vertex_count;
        shape_surface(s, 72, 8, 24, 1, ring_point, &rings[i].ring);
        shape_stand(s, first, centre, rings[i].axis);
    }
    double rod[2][3], radii[2] = {0.006, 0.006};
    for (int k = 0; k < 3; k++) {
        rod[0][k] = centre[k] - 1.12 * radius * pole[k];
        rod[1][k] = centre[k] + 1.12 * radius * pole[k];
    }
    shape_tube(s, (const double(*)[3])rod, radii, 2, 8);
    uint32_t first = s->vertex_count;
    shape_sphere(s, radius * 0.20, 16);
    shape_move(s, first, 0, height, 0, 0, 1);
    double neck = height - radius - 0.012;
    const double stand[][3] = {{0, 0, 1}, {0.17, 0, 1}, {0.17, 0.025, 1}, {0.12, 0.05, 0},
        {0.045, 0.10, 0}, {0.03, neck * 0.45, 0}, {0.05, neck * 0.55, 0}, {0.022, neck * 0.68, 0},
        {0.035, neck - 0.03, 0}, {0.02, neck, 1}, {0, neck, 1}};
    shape_lathe(s, stand, 11, 5, 24, 1, 1);
}
