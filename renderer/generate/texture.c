/* Procedural textures, all of which repeat without a seam. */
#include "renderer/generate/texture.h"
#include "protocol/memory.h"
#include <math.h>
#include <stdlib.h>

static double lattice(uint32_t x, uint32_t y, uint32_t seed)
{
    uint32_t h = x * 0x8da6b343u ^ y * 0xd8163841u ^ seed * 0xcb1ab31fu;
    h = (h ^ h >> 15) * 0x2c1b3c6du;
    h = (h ^ h >> 12) * 0x297a2d39u;
    return (h ^ h >> 15) / 4294967296.0;
}

/* Value noise on a lattice of `period` cells per unit. */
static double noise(double u, double v, uint32_t period, uint32_t seed)
{
    double x = u * period, y = v * period, fx = floor(x), fy = floor(y);
    double s = x - fx, t = y - fy;
    uint32_t i = (uint32_t)((int64_t)fx % period + period) % period;
    uint32_t j = (uint32_t)((int64_t)fy % period + period) % period;
    uint32_t i1 = (i + 1) % period, j1 = (j + 1) % period;
    s = s * s * (3 - 2 * s);
    t = t * t * (3 - 2 * t);
    double a = lattice(i, j, seed), b = lattice(i1, j, seed);
    double c = lattice(i, j1, seed), d = lattice(i1, j1, seed);
    return a + s * (b - a) + t * (c - a) + s * t * (a - b - c + d);
}

/* Octaves of noise, each twice as fine and half as strong; 0..1. */
static double fractal(double u, double v, uint32_t period, uint32_t octaves, uint32_t seed)
{
    double sum = 0, weight = 0;
    for (uint32_t o = 0; o < octaves; o++) {
        double w = 1.0 / (1u << o);
        sum += w * noise(u, v, period << o, seed + o);
        weight += w;
    }
    return sum / weight;
}

static double smooth(double low, double high, double x)
{
    double t = fmin(fmax((x - low) / (high - low), 0), 1);
    return t * t * (3 - 2 * t);
}

/* Distance to the nearest joint, in units of the texture, and which slab this is. Every second row
 * is shifted by half a slab. */
static double slab(double u, double v, uint32_t *which)
{
    const double n = 4;
    double row = floor(v * n), x = u * n + (fmod(row, 2) == 0 ? 0 : 0.5), column = floor(x);
    double s = x - column, t = v * n - row;
    *which = (uint32_t)row * 16 + (uint32_t)column % 4;
    return fmin(fmin(s, 1 - s), fmin(t, 1 - t)) / n;
}

static double paving_height(double u, double v)
{
    uint32_t which;
    double joint = slab(u, v, &which);
    double wobble = 0.004 * (fractal(u, v, 16, 3, 5) - 0.5);
    return smooth(0.002, 0.012, joint + wobble) + 0.10 * fractal(u, v, 12, 5, 9);
}

static double stone_height(double u, double v)
{
    return 0.5 * fractal(u, v, 6, 6, 21);
}

static void store(uint8_t *texel, double r, double g, double b, double a)
{
    const double c[4] = {r, g, b, a};
    for (int k = 0; k < 4; k++)
        texel[k] = (uint8_t)(fmin(fmax(c[k], 0), 1) * 255 + 0.5);
}

uint32_t texture_paving(struct model *model, uint32_t side)
{
    uint8_t *rgba = pen_alloc(side * side, 4);
    for (uint32_t y = 0; y < side; y++)
        for (uint32_t x = 0; x < side; x++) {
            double u = (x + 0.5) / side, v = (y + 0.5) / side;
            uint32_t which;
            double joint = slab(u, v, &which);
            joint += 0.004 * (fractal(u, v, 16, 3, 5) - 0.5);
            double tint = 0.14 * (lattice(which, 1, 3) - 0.5),
                   warm = 0.05 * (lattice(which, 2, 3) - 0.5);
            double grain = 0.16 * (fractal(u, v, 8, 6, 9) - 0.5);
            double light = (0.70 + tint + grain) * (0.55 + 0.45 * smooth(0.001, 0.008, joint));
            store(rgba + 4 * (y * side + x), light * (1.0 + warm), light * 0.955,
                light * (0.88 - warm), 1);
        }
    return model_image(model, side, side, true, rgba);
}

uint32_t texture_stone(struct model *model, uint32_t side)
{
    uint8_t *rgba = pen_alloc(side * side, 4);
    for (uint32_t y = 0; y < side; y++)
        for (uint32_t x = 0; x < side; x++) {
            double u = (x + 0.5) / side, v = (y + 0.5) / side;
            double cloud = fractal(u, v, 3, 6, 31);
            double vein = fabs(fractal(u, v, 4, 5, 57) - 0.5);
            double light = 0.84 + 0.16 * cloud - 0.10 * (1 - smooth(0, 0.035, vein));
            store(rgba + 4 * (y * side + x), light, light * 0.985, light * 0.95, 1);
        }
    return model_image(model, side, side, true, rgba);
}

/* Tangent-space normals of a height field over the unit square, heights times `strength`. */
static uint32_t normal_map(
    struct model *model, uint32_t side, double (*height)(double, double), double strength)
{
    uint8_t *rgba = pen_alloc(side * side, 4);
    float *field = pen_alloc(side * side, sizeof *field);
    for (uint32_t y = 0; y < side; y++)
        for (uint32_t x = 0; x < side; x++)
            field[y * side + x] = (float)height((x + 0.5) / side, (y + 0.5) / side);
    for (uint32_t y = 0; y < side; y++)
        for (uint32_t x = 0; x < side; x++) {
            uint32_t right = (x + 1) % side, left = (x + side - 1) % side;
            uint32_t below = (y + 1) % side, above = (y + side - 1) % side;
            double slope = strength * side / 2;
            double n[3] = {slope * (field[y * side + left] - field[y * side + right]),
                slope * (field[below * side + x] - field[above * side + x]), 1};
            normalize3(n);
            store(rgba + 4 * (y * side + x), n[0] / 2 + 0.5, n[1] / 2 + 0.5, n[2] / 2 + 0.5, 1);
        }
    free(field);
    return model_image(model, side, side, false, rgba);
}

uint32_t texture_paving_normal(struct model *model, uint32_t side)
{
    return normal_map(model, side, paving_height, 0.008);
}

uint32_t texture_stone_normal(struct model *model, uint32_t side)
{
    return normal_map(model, side, stone_height, 0.02);
}

/* Pointed oval with a serrated edge; colour continues outside, so that no dark rim
 * is filtered in. */
uint32_t texture_leaf(struct model *model, uint32_t side)
{
    uint8_t *rgba = pen_alloc(side * side, 4);
    for (uint32_t y = 0; y < side; y++)
        for (uint32_t x = 0; x < side; x++) {
            double px = 2 * (x + 0.5) / side - 1,
                   up = 1 - (y + 0.5) / side; /* stem at 0, tip at 1 */
            double blade = (up - 0.08) / 0.9;
            double half =
                blade > 0 && blade < 1 ? 0.88 * pow(sin(M_PI * pow(blade, 0.8)), 0.85) : 0;
            half *= 1 - 0.12 * fabs(sin(M_PI * 9 * blade));
            double edge = fmax(half - fabs(px), 0.05 * (up < 0.15) - fabs(px));
            double rib = fabs(px) < 0.03 ? 1 : 0;
            double side_rib = fabs(sin(M_PI * 5 * (blade - 0.35 * fabs(px)))) < 0.10 ? 0.6 : 0;
            double light =
                1 + 0.35 * fmax(rib, side_rib) + 0.2 * (fractal(px / 2, up, 4, 4, 77) - 0.5);
            store(rgba + 4 * (y * side + x), 0.42 * light, 0.60 * light, 0.24 * light,
                0.5 + edge * side / 4);
        }
    uint32_t image = model_image(model, side, side, true, rgba);
    model->images[image].wrap = PSC_CLAMP;
    return image;
}
