/* Scenes of a wanted size, for benchmarks: hair, leaves, columns. */
#include "renderer/generate/generate.h"
#include "renderer/generate/model.h"
#include "renderer/generate/texture.h"
#include <math.h>
#include <stdlib.h>

#define HAIR_PARTS 16 /* spans along one hair */
#define HAIR_SIDES 3  /* enough for a hair of 2 mm */
#define HAIR_TRIANGLES (2 * HAIR_SIDES * HAIR_PARTS)

struct ball {
    double x, y, z, radius;
};

static void ball_point(const void *context, double u, double v, double p[3])
{
    const struct ball *b = context;
    double angle = 2 * M_PI * (u == 1 ? 0 : u), r = b->radius * sin(M_PI * v);
    p[0] = b->x + (v == 1 ? 0 : r) * cos(angle);
    p[1] = b->y - b->radius * cos(M_PI * v);
    p[2] = b->z - (v == 1 ? 0 : r) * sin(angle);
}

/* One curved hair: its direction turns at a steady rate about a random axis, with some noise. */
static void hair(struct shape *s, struct dice *dice, const double centre[3], double root)
{
    double along[3], axis[3], at[3], points[HAIR_PARTS + 1][3], radii[HAIR_PARTS + 1];
    dice_direction(dice, along);
    dice_direction(dice, axis);
    double curl = dice_uniform(dice, 0.03, 0.32),
           step = dice_uniform(dice, 0.8, 1.2) * 0.6 / HAIR_PARTS;
    for (int k = 0; k < 3; k++)
        at[k] = centre[k] + root * along[k];
    for (int i = 0; i <= HAIR_PARTS; i++) {
        double turn[3];
        for (int k = 0; k < 3; k++)
            points[i][k] = at[k];
        radii[i] = 0.0016 * (1 - 0.7 * i / HAIR_PARTS);
        cross3(axis, along, turn);
        for (int k = 0; k < 3; k++)
            along[k] += curl * turn[k] + dice_uniform(dice, -0.06, 0.06);
        normalize3(along);
        for (int k = 0; k < 3; k++)
            at[k] += step * along[k];
    }
    shape_tube(s, (const double(*)[3])points, radii, HAIR_PARTS + 1, HAIR_SIDES);
}

static void hairball(struct model *model, const struct pen_generated_options *o)
{
    const double centre[3] = {0, 1, 0}, root = 0.4;
    struct dice dice = dice_seed(o->seed);
    struct shape core = {0}, hairs = {0};
    uint32_t rows = o->triangles < 20000 ? 6 : 24;
    struct ball ball = {centre[0], centre[1], centre[2], root};
    shape_surface(&core, 2 * rows, rows, 1, 1, ball_point, &ball);
    uint32_t rest = o->triangles > core.index_count / 3 ? o->triangles - core.index_count / 3 : 0;
    uint32_t count = (rest + HAIR_TRIANGLES / 2) / HAIR_TRIANGLES;
    shape_reserve(&hairs, count * (HAIR_PARTS + 1) * (HAIR_SIDES + 1), 3 * count * HAIR_TRIANGLES);
    for (uint32_t i = 0; i < count; i++)
        hair(&hairs, &dice, centre, root * 0.99);
    uint32_t skin = model_mesh(model, &core, model_material(model, 0.25, 0.16, 0.10, 0.9, 0));
    model_place(model, skin, 0, 0, 0, 0, 1);
    if (count) {
        uint32_t fur = model_mesh(model, &hairs, model_material(model, 0.55, 0.36, 0.20, 0.5, 0));
        model_place(model, fur, 0, 0, 0, 0, 1);
    }
    model_look(model, (double[]){2.0, 1.9, 2.6}, (double[]){0, 0.85, 0}, 45);
}

/* A quad (masked by its texture), or a folded solid leaf of four triangles. */
static void leaf(struct shape *s, struct dice *dice, const double at[3], double size, bool solid)
{
    double along[3], across[3], up[3], a[3], b[3], c[3], d[3];
    dice_direction(dice, along);
    along[1] *= 0.5;
    normalize3(along);
    any_perpendicular(along, across);
    cross3(across, along, up);
    double turn = dice_uniform(dice, 0, 2 * M_PI), cs = cos(turn), sn = sin(turn);
    for (int k = 0; k < 3; k++)
        across[k] = cs * across[k] + sn * up[k];
    cross3(across, along, up);
    if (!solid) {
        for (int k = 0; k < 3; k++) {
            a[k] = at[k] - 0.35 * size * across[k];
            b[k] = at[k] + 0.35 * size * across[k];
            c[k] = b[k] + size * along[k];
            d[k] = a[k] + size * along[k];
        }
        shape_quad(s, a, b, c, d, 1, 1);
        return;
    }
    for (int side = -1; side <= 1; side += 2) { /* two halves that rise from the rib */
        for (int k = 0; k < 3; k++) {
            a[k] = at[k];
            b[k] = at[k] + 0.35 * size * along[k] + side * 0.30 * size * across[k] +
                   0.10 * size * up[k];
            c[k] = at[k] + 0.70 * size * along[k] + side * 0.22 * size * across[k] +
                   0.08 * size * up[k];
            d[k] = at[k] + size * along[k];
        }
        if (side < 0)
            shape_quad(s, d, c, b, a, 1, 1);
        else
            shape_quad(s, a, b, c, d, 1, 1);
    }
}

/* Shrubs on a lawn: every shrub an ellipsoid of leaves, one in three of them solid. */
static void foliage(struct model *model, const struct pen_generated_options *o)
{
    struct dice dice = dice_seed(o->seed);
    struct shape ground = {0}, masked = {0}, solid = {0};
    enum { SHRUBS = 9 };
    struct ball shrubs[SHRUBS];
    double volume = 0;
    for (int i = 0; i < SHRUBS; i++) {
        double r = dice_uniform(&dice, 0.35, 0.75);
        double x = (i % 3 - 1) * 1.7 + dice_uniform(&dice, -0.3, 0.3);
        double z = (i / 3 - 1) * 1.7 + dice_uniform(&dice, -0.3, 0.3);
        shrubs[i] = (struct ball){x, 0.12 + r * 0.9, z, r};
        volume += r * r * r;
    }
    shape_quad(&ground, (double[]){-3, 0, 3}, (double[]){3, 0, 3}, (double[]){3, 0, -3},
        (double[]){-3, 0, -3}, 1, 1);
    /* One solid leaf of four triangles for each two masked ones of two: eight triangles. */
    uint32_t groups = o->triangles / 8 ? o->triangles / 8 : 1;
    double size = fmin(0.22, 1.1 * cbrt(volume / (3.0 * groups)) + 0.03);
    shape_reserve(&masked, groups * 8, groups * 12);
    shape_reserve(&solid, groups * 8, groups * 12);
    uint32_t done = 0;
    double share = 0;
    for (int i = 0; i < SHRUBS; i++) {
        const struct ball *shrub = &shrubs[i];
        share += shrub->radius * shrub->radius * shrub->radius / volume;
        uint32_t until = i == SHRUBS - 1 ? groups : (uint32_t)(share * groups);
        for (; done < until; done++)
            for (int k = 0; k < 3; k++) {
                double v[3];
                dice_direction(&dice, v);
                double r = shrub->radius * cbrt(dice_uniform(&dice, 0.15, 1));
                const double at[3] = {
                    shrub->x + r * v[0], shrub->y + 0.9 * r * v[1], shrub->z + r * v[2]};
                leaf(k ? &masked : &solid, &dice, at, size * dice_uniform(&dice, 0.7, 1.3), k == 0);
            }
    }
    uint32_t lawn = model_material(model, 0.16, 0.22, 0.10, 1, 0);
    uint32_t cut = model_material(model, 1, 1, 1, 0.7, 0);
    model->materials[cut].base = model_texture(texture_leaf(model, 128));
    model->materials[cut].alpha_mode = PSC_MASK;
    model->materials[cut].flags = PSC_DOUBLE_SIDED;
    uint32_t whole = model_material(model, 0.20, 0.34, 0.08, 0.6, 0);
    model->materials[whole].flags = PSC_DOUBLE_SIDED;
    model_place(model, model_mesh(model, &ground, lawn), 0, 0, 0, 0, 1);
    model_place(model, model_mesh(model, &masked, cut), 0, 0, 0, 0, 1);
    model_place(model, model_mesh(model, &solid, whole), 0, 0, 0, 0, 1);
    model_look(model, (double[]){3.6, 2.8, 4.6}, (double[]){0, 0.5, 0}, 42);
}

static uint32_t column_triangles(double detail)
{
    struct shape s = {0};
    shape_column(&s, 2.4, 0.2, detail);
    uint32_t triangles = s.index_count / 3;
    shape_finish(&s);
    return triangles;
}

/* Four rows of six instances of one column, as detailed as the wanted number allows. */
static void columns(struct model *model, const struct pen_generated_options *o)
{
    const uint32_t rows = 4, per_row = 6;
    double low = 0.02, high = 20;
    for (int i = 0; i < 14; i++) { /* coarser when even the middle is too many */
        double middle = sqrt(low * high);
        if (column_triangles(middle) * rows * per_row > o->triangles)
            high = middle;
        else
            low = middle;
    }
    struct shape column = {0}, ground = {0};
    shape_column(&column, 2.4, 0.2, low);
    shape_quad(&ground, (double[]){-3.5, 0, 2.5}, (double[]){3.5, 0, 2.5}, (double[]){3.5, 0, -2.5},
        (double[]){-3.5, 0, -2.5}, 7, 5);
    uint32_t floor_mesh =
        model_mesh(model, &ground, model_material(model, 0.45, 0.43, 0.40, 0.9, 0));
    uint32_t mesh = model_mesh(model, &column, model_material(model, 0.75, 0.72, 0.66, 0.7, 0));
    model_place(model, floor_mesh, 0, 0, 0, 0, 1);
    struct dice dice = dice_seed(o->seed);
    for (uint32_t i = 0; i < rows; i++)
        for (uint32_t j = 0; j < per_row; j++)
            model_place(model, mesh, (j - 2.5) * 1.1, 0, (i - 1.5) * 1.15,
                90 * floor(dice_uniform(&dice, 0, 4)), 1);
    model_look(model, (double[]){4.2, 2.6, 5.2}, (double[]){0, 0.8, 0}, 45);
}

void model_load(struct model *model, const struct pen_generated_options *o)
{
    if (o->kind == PEN_GENERATED_HAIRBALL)
        hairball(model, o);
    else if (o->kind == PEN_GENERATED_FOLIAGE)
        foliage(model, o);
    else
        columns(model, o);
}
