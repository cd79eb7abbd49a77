/* The demo: a paved court of about 6 m in which shadows harden towards their contacts. Thin casters
 * (fence, rings, branches, leaves) and thick ones (columns, arch, globe), near their receivers and
 * far from them; the wall is a second, upright receiver. */
#include "renderer/generate/demo.h"
#include "renderer/generate/generate.h"
#include "renderer/generate/model.h"
#include "renderer/generate/texture.h"
#include <math.h>

struct demo_materials {
    uint32_t paving, wall, marble, iron, bronze, red, blue, bark, leaf, clay, gold;
};

static struct demo_materials make_materials(struct model *model)
{
    struct demo_materials m = {
        .paving = model_material(model, 0.95, 0.92, 0.86, 0.85, 0),
        .wall = model_material(model, 0.78, 0.62, 0.45, 0.95, 0),
        .marble = model_material(model, 0.92, 0.89, 0.82, 0.55, 0),
        .iron = model_material(model, 0.035, 0.037, 0.042, 0.45, 0),
        .bronze = model_material(model, 0.80, 0.47, 0.20, 0.32, 0.75),
        .red = model_material(model, 0.55, 0.035, 0.03, 0.12, 0),
        .blue = model_material(model, 0.03, 0.14, 0.38, 0.18, 0),
        .bark = model_material(model, 0.19, 0.12, 0.075, 0.95, 0),
        .leaf = model_material(model, 1, 1, 1, 0.6, 0),
        .clay = model_material(model, 0.58, 0.23, 0.11, 0.9, 0),
        .gold = model_material(model, 0.95, 0.70, 0.28, 0.28, 0.8),
    };
    struct psc_material *materials = model->materials;
    materials[m.paving].base = model_texture(texture_paving(model, 512));
    materials[m.paving].normal = model_texture(texture_paving_normal(model, 512));
    uint32_t stone = texture_stone(model, 256), rough = texture_stone_normal(model, 256);
    materials[m.wall].base = materials[m.marble].base = model_texture(stone);
    materials[m.wall].normal = model_texture(rough);
    materials[m.leaf].base = model_texture(texture_leaf(model, 128));
    materials[m.leaf].alpha_mode = PSC_MASK;
    materials[m.leaf].flags = PSC_DOUBLE_SIDED;
    return m;
}

static void ground(struct model *model, const struct demo_materials *m)
{
    struct shape s = {0};
    const double half = 3.3, edge = 0.14;
    for (int i = -3; i < 3; i++) /* pieces, so that culling has something to cull */
        for (int j = -3; j < 3; j++) {
            double x = i * half / 3, z = j * half / 3, w = half / 3;
            uint32_t first = s.vertex_count;
            shape_quad(&s, (double[]){x, 0, z + w}, (double[]){x + w, 0, z + w},
                (double[]){x + w, 0, z}, (double[]){x, 0, z}, 1, 1);
            for (uint32_t k = first; k < s.vertex_count; k++) {
                s.uv[k][0] = s.positions[k][0] / 2.2f;
                s.uv[k][1] = s.positions[k][2] / 2.2f;
            }
        }
    for (int i = 0; i < 4; i++) {
        uint32_t first = s.vertex_count;
        shape_quad(&s, (double[]){-half, -edge, half}, (double[]){half, -edge, half},
            (double[]){half, 0, half}, (double[]){-half, 0, half}, 3, 0.06);
        shape_move(&s, first, 0, 0, 0, 90 * i, 1);
    }
    model_place(model, model_mesh(model, &s, m->paving), 0, 0, 0, 0, 1);
}

static void masonry(struct model *model, const struct demo_materials *m)
{
    struct shape s = {0};
    shape_wall(&s, 4.1, 0.95, 0.26, 11);
    shape_move(&s, 0, -2.95, 0, -2.75, 0, 1);
    uint32_t first = s.vertex_count;
    shape_wall(&s, 2.9, 0.55, 0.24, 12);
    shape_move(&s, first, -2.85, 0, 0.30, 90, 1);
    model_place(model, model_mesh(model, &s, m->wall), 0, 0, 0, 0, 1);

    shape_arch(&s, 1.0, 1.45, 0.34);
    model_place(model, model_mesh(model, &s, m->wall), 2.05, 0, -2.2, -16, 1);

    shape_column(&s, 2.35, 0.175, 1.25);
    uint32_t column = model_mesh(model, &s, m->marble);
    for (int i = 0; i < 3; i++)
        model_place(model, column, -2.0, 0, -1.75 + 1.2 * i, 0, 1);

    /* A drum of a fourth column, lying on its side. */
    shape_column(&s, 0.85, 0.175, 0.9);
    const double at[3] = {-1.62, 0.254, 1.85}, axis[3] = {0.906, 0, 0.423};
    shape_stand(&s, 0, at, axis);
    model_place(model, model_mesh(model, &s, m->marble), 0, 0, 0, 0, 1);
}

static void metalwork(struct model *model, const struct demo_materials *m)
{
    struct shape s = {0};
    shape_fence(&s, 2.4, 1.0, 0.12); /* out in the court */
    shape_move(&s, 0, -0.55, 0, 2.35, 12, 1);
    uint32_t first = s.vertex_count;
    shape_fence(&s, 1.9, 1.25, 0.10); /* just in front of the wall */
    shape_move(&s, first, -1.70, 0, -2.38, 0, 1);
    model_place(model, model_mesh(model, &s, m->iron), 0, 0, 0, 0, 1);

    shape_armillary(&s, 1.25, 0.40);
    model_place(model, model_mesh(model, &s, m->gold), 2.35, 0, -0.35, 20, 1);

    shape_knot(&s, 0.34, 0.075);
    const double at[3] = {1.0, 1.02, 0.55}, axis[3] = {0.30, 0.30, 0.905};
    shape_stand(&s, 0, at, axis);
    model_place(model, model_mesh(model, &s, m->bronze), 0, 0, 0, 0, 1);
    shape_box(&s, (double[]){-0.27, 0, -0.27}, (double[]){0.27, 0.08, 0.27});
    shape_box(&s, (double[]){-0.21, 0.08, -0.21}, (double[]){0.21, 0.50, 0.21});
    shape_box(&s, (double[]){-0.25, 0.50, -0.25}, (double[]){0.25, 0.56, 0.25});
    model_place(model, model_mesh(model, &s, m->marble), 1.0, 0, 0.55, 18, 1);
}

static void pottery(struct model *model, const struct demo_materials *m)
{
    struct shape s = {0};
    shape_sphere(&s, 1, 32);
    uint32_t ball = model_mesh(model, &s, m->red);
    model_place(model, ball, -0.35, 0.30, 0.95, 0, 0.30);
    model_place(model, ball, 0.12, 0.13, 1.42, 0, 0.13);
    model_place(model, ball, -0.12, 0.06, 1.62, 0, 0.06);

    const double vase[][3] = {{0, 0, 1}, {0.105, 0, 1}, {0.11, 0.015, 0}, {0.10, 0.03, 1},
        {0.17, 0.14, 0}, {0.205, 0.27, 0}, {0.165, 0.40, 0}, {0.085, 0.50, 0}, {0.07, 0.56, 0},
        {0.115, 0.63, 1}, {0.105, 0.632, 1}, {0.058, 0.56, 0}, {0.07, 0.50, 0}, {0.15, 0.39, 0},
        {0.18, 0.27, 0}, {0.09, 0.06, 0}, {0, 0.04, 1}};
    shape_lathe(&s, vase, 17, 5, 56, 2, 1);
    uint32_t blue = model_mesh(model, &s, m->blue);
    model_place(model, blue, 2.15, 0, 1.35, 0, 1.15);
    model_place(model, blue, 0.80, 0.95, -2.75, 40, 0.62);

    const double pot[][3] = {{0, 0, 1}, {0.13, 0, 1}, {0.185, 0.24, 1}, {0.205, 0.24, 1},
        {0.21, 0.31, 1}, {0.185, 0.315, 1}, {0.175, 0.27, 1}, {0, 0.26, 1}};
    shape_lathe(&s, pot, 8, 4, 40, 2, 1);
    uint32_t clay = model_mesh(model, &s, m->clay);
    model_place(model, clay, 2.62, 0, 0.85, 0, 1);
    model_place(model, clay, 1.72, 0, 1.88, 0, 0.72);
    model_place(model, clay, -2.85, 0.55, -0.55, 0, 0.8);
}

static void planting(struct model *model, const struct demo_materials *m)
{
    struct shape wood = {0}, leaves = {0}, curb = {0};
    shape_tree(&wood, &leaves, 3);
    model_place(model, model_mesh(model, &wood, m->bark), 0.40, 0.05, -0.95, 0, 1);
    model_place(model, model_mesh(model, &leaves, m->leaf), 0.40, 0.05, -0.95, 0, 1);
    const double profile[][3] = {{0.50, 0, 1}, {0.50, 0.13, 1}, {0.485, 0.145, 1},
        {0.415, 0.145, 1}, {0.40, 0.13, 1}, {0.40, 0.05, 1}, {0.25, 0.065, 0}, {0, 0.075, 1}};
    shape_lathe(&curb, profile, 8, 4, 64, 8, 0.4);
    model_place(model, model_mesh(model, &curb, m->wall), 0.40, 0, -0.95, 0, 1);
}

void model_demo(struct model *model, const struct pen_generated_options *o)
{
    (void)o;
    struct demo_materials m = make_materials(model);
    ground(model, &m);
    masonry(model, &m);
    metalwork(model, &m);
    pottery(model, &m);
    planting(model, &m);
    model_look(model, (double[]){3.7, 2.75, 5.6}, (double[]){-0.05, 0.72, -0.35}, 38);
}
