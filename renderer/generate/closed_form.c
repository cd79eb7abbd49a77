/* Scenes whose visibility is known in closed form (T1 to T7). Every one has a receiver at
 * y = 0 that is at least as wide as its half-plane casters, so that below a caster no
 * light passes outside. */
#include "protocol/memory.h"
#include "renderer/generate/generate.h"
#include "renderer/generate/model.h"
#include <math.h>

#define HALF 4.0 /* m, half the receiver's side */

/* Zero-thickness, facing up: x0..x1, z0..z1 at height y. */
static uint32_t plate(
    struct model *model, double x0, double x1, double z0, double z1, double y, uint32_t material)
{
    struct shape s = {0};
    shape_quad(&s, (double[]){x0, y, z1}, (double[]){x1, y, z1}, (double[]){x1, y, z0},
        (double[]){x0, y, z0}, 1, 1);
    uint32_t mesh = model_mesh(model, &s, material);
    model_place(model, mesh, 0, 0, 0, 0, 1);
    return mesh;
}

static void receiver(struct model *model)
{
    plate(model, -HALF, HALF, -HALF, HALF, 0, model_material(model, 0.5, 0.5, 0.5, 1, 0));
}

static uint32_t caster_material(struct model *model, double r, double g, double b)
{
    uint32_t material = model_material(model, r, g, b, 1, 0);
    model->materials[material].flags = PSC_DOUBLE_SIDED;
    return material;
}

/* A five-pointed star with a round hole, 256 x 256; nearest sampling without levels, so that the
 * mask is exactly its texels. */
static uint32_t star_image(struct model *model)
{
    const uint32_t side = 256;
    uint8_t *rgba = pen_alloc(side * side, 4);
    for (uint32_t y = 0; y < side; y++)
        for (uint32_t x = 0; x < side; x++) {
            double px = 2 * (x + 0.5) / side - 1, py = 1 - 2 * (y + 0.5) / side;
            double r = hypot(px, py), angle = atan2(px, py);    /* one point straight up */
            double part = fabs(remainder(angle, 2 * M_PI / 5)); /* 0 at a point, pi/5 between */
            /* The edge from the tip (radius 0.95) to the notch (0.4, at pi/5), as
             * a straight line. */
            double nx = 0.4 * sin(M_PI / 5), ny = 0.4 * cos(M_PI / 5), tip = 0.95;
            double qx = r * sin(part), qy = r * cos(part);
            bool inside = nx * (qy - tip) - (ny - tip) * qx < 0 && r > 0.18;
            uint8_t *texel = rgba + 4 * (y * side + x);
            texel[0] = 200;
            texel[1] = 160;
            texel[2] = 60;
            texel[3] = inside ? 255 : 0;
        }
    uint32_t image = model_image(model, side, side, true, rgba);
    model->images[image].wrap = PSC_CLAMP;
    model->images[image].nearest = 1 | 2 | 8;
    return image;
}

static void planar_mask(struct model *model, const struct pen_generated_options *o)
{
    uint32_t material = caster_material(model, 1, 1, 1);
    struct psc_material *m = &model->materials[material];
    m->alpha_mode = PSC_MASK;
    m->base = model_texture(star_image(model));
    double h = o->caster_half_size;
    plate(model, -h, h, -h, h, o->caster_height, material);
}

/* The upper side of a convex body: a flat top of separate tiles and four skirts that fall away from
 * it. A convex surface never shadows itself, whatever the light, and no part of it faces away from
 * a light that is above the skirts' planes. */
static void empty_room(struct model *model)
{
    const double top = 2.5, run = 1.5, drop = run * tan(8 * M_PI / 180);
    uint32_t floor_material = model_material(model, 0.5, 0.5, 0.5, 1, 0);
    uint32_t skirt_material = model_material(model, 0.6, 0.45, 0.35, 1, 0);
    struct shape s = {0};
    const double t = top / 2;
    shape_quad(&s, (double[]){0, 0, t}, (double[]){t, 0, t}, (double[]){t, 0, 0},
        (double[]){0, 0, 0}, 1, 1);
    uint32_t tile = model_mesh(model, &s, floor_material);
    for (int i = -2; i < 2; i++)
        for (int j = -2; j < 2; j++)
            model_place(model, tile, i * t, 0, j * t, 0, 1);
    double out = top + run;
    shape_quad(&s, (double[]){-out, -drop, out}, (double[]){out, -drop, out},
        (double[]){top, 0, top}, (double[]){-top, 0, top}, 1, 1);
    uint32_t skirt = model_mesh(model, &s, skirt_material);
    for (int i = 0; i < 4; i++)
        model_place(model, skirt, 0, 0, 0, 90 * i, 1);
}

void model_closed_form(struct model *model, const struct pen_generated_options *o)
{
    const double side_view[] = {1.9, fmin(0.9, 0.75 * o->caster_height), 1.3};
    const double high_view[] = {2.2, 2.4, 3.4}, origin[] = {0, 0, 0};
    const double edge[] = {-0.05, 0, -0.2};
    model_look(model, high_view, origin, 45);
    if (o->kind == PEN_GENERATED_EMPTY_ROOM) {
        empty_room(model);
        return;
    }
    receiver(model);
    double high = fmax(o->caster_height, o->second_height);
    double low = fmin(o->caster_height, o->second_height), h = o->caster_half_size;
    switch (o->kind) {
    case PEN_GENERATED_HALF_PLANE:
        plate(
            model, -HALF, 0, -HALF, HALF, o->caster_height, caster_material(model, 0.8, 0.4, 0.2));
        model_look(model, side_view, edge, 50);
        break;
    case PEN_GENERATED_SQUARE:
        plate(model, -h, h, -h, h, o->caster_height, caster_material(model, 0.8, 0.4, 0.2));
        break;
    case PEN_GENERATED_STACKED:
        /* The lower one alone blocks all light; the edge of the upper one lies over it, so that a
         * filter there sees two depths and must not conclude that light passes. */
        plate(model, -HALF, -0.6, -HALF, HALF, high, caster_material(model, 0.8, 0.4, 0.2));
        plate(model, -HALF, 0, -HALF, HALF, low, caster_material(model, 0.2, 0.4, 0.8));
        model_look(model, side_view, edge, 50);
        break;
    case PEN_GENERATED_DUPLICATE:
        plate(model, -HALF, 0, -HALF, HALF, high, caster_material(model, 0.8, 0.4, 0.2));
        plate(model, -HALF, 0, -HALF, HALF, low, caster_material(model, 0.2, 0.4, 0.8));
        model_look(model, side_view, edge, 50);
        break;
    case PEN_GENERATED_PLANAR_MASK:
        planar_mask(model, o);
        break;
    default: /* PEN_GENERATED_PLANE */
        break;
    }
}
