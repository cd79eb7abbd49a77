/* The shader's hierarchy: what its layout promises, and its answers against every
 * triangle in turn. */
#include "renderer/trace/bvh.h"
#include "renderer/blob/builder.h"
#include "tests/unit/check.h"

_Static_assert(sizeof(struct pen_bvh_node) == 32, "std430 layout");
_Static_assert(sizeof(struct pen_bvh_triangle) == 48, "std430 layout");

static uint32_t random_state = 5;

static float uniform(float low, float high)
{
    random_state = random_state * 1664525u + 1013904223u;
    return low + (high - low) * (float)(random_state >> 8) / (1 << 24);
}

/* Checks the whole tree; `seen` counts the triangles by first_index. */
static void check_node(
    const struct pen_bvh *bvh, uint32_t at, uint32_t depth, uint32_t *seen, uint32_t *deepest)
{
    const struct pen_bvh_node *node = &bvh->nodes[at];
    CHECK(at < bvh->node_count && depth < PEN_BVH_STACK);
    *deepest = depth > *deepest ? depth : *deepest;
    if (node->count == 0 && bvh->triangle_count) {
        for (uint32_t child = node->first; child < node->first + 2; child++) {
            for (int c = 0; c < 3; c++)
                CHECK(bvh->nodes[child].low[c] >= node->low[c] &&
                      bvh->nodes[child].high[c] <= node->high[c]);
            check_node(bvh, child, depth + 1, seen, deepest);
        }
        return;
    }
    CHECK(node->count <= PEN_BVH_LEAF && node->first + node->count <= bvh->triangle_count);
    for (uint32_t i = node->first; i < node->first + node->count; i++) {
        const struct pen_bvh_triangle *t = &bvh->triangles[i];
        seen[t->first_index]++;
        for (int c = 0; c < 3; c++) {
            float a = t->corner[c], b = a + t->edge1[c], d = a + t->edge2[c];
            CHECK(a >= node->low[c] && b >= node->low[c] && d >= node->low[c]);
            CHECK(a <= node->high[c] && b <= node->high[c] && d <= node->high[c]);
        }
    }
}

static void check_tree(const struct pen_bvh *bvh)
{
    uint32_t *seen = calloc(bvh->triangle_count + 1, sizeof *seen), deepest = 0;
    check_node(bvh, 0, 0, seen, &deepest);
    for (uint32_t i = 0; i < bvh->triangle_count; i++)
        CHECK(seen[i] == 1);
    CHECK(deepest == bvh->depth);
    free(seen);
}

/* In double precision: 1 hit, 0 miss, -1 too close to call. */
static int slow_hit(
    bool front_only, const struct pen_bvh_triangle *t, const float o[3], const float d[3])
{
    double m[3][3], s[3], x[3], determinant = 0;
    for (int c = 0; c < 3; c++) {
        m[c][0] = (double)t->edge1[c];
        m[c][1] = (double)t->edge2[c];
        m[c][2] = -(double)d[c];
        s[c] = (double)o[c] - (double)t->corner[c];
    }
    for (int k = -1; k < 3; k++) { /* Cramer */
        double a[3][3];
        for (int c = 0; c < 9; c++)
            a[c / 3][c % 3] = c % 3 == k ? s[c / 3] : m[c / 3][c % 3];
        double value = a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) -
                       a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0]) +
                       a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0]);
        if (k < 0)
            determinant = value;
        else
            x[k] = value / determinant;
    }
    if (determinant == 0)
        return 0;
    double margin = fmin(fmin(x[0], x[1]), fmin(1 - x[0] - x[1], fmin(x[2], 1 - x[2])));
    double size = 0; /* a float ray cannot aim better than at 1e-7 of its length */
    for (int c = 0; c < 3; c++)
        size = fmax(size, (double)fmaxf(fabsf(t->edge1[c]), fabsf(t->edge2[c])));
    if (fabs(margin) < 1e-5 + 2e-6 / size)
        return -1;
    /* The determinant is minus the normal's dot with d: negative when the front faces along d. */
    return margin > 0 && (!front_only || determinant < 0 || (t->flags & PEN_BVH_TWO_SIDED));
}

static void check_rays(const struct pen_bvh *bvh, int rays, float size)
{
    int wrong = 0, hits = 0, close = 0;
    for (int i = 0; i < rays; i++) {
        float o[3], d[3];
        int truth = 0;
        bool front_only = i / 3 % 2;
        for (int c = 0; c < 3; c++) {
            o[c] = uniform(-size, size);
            d[c] = uniform(-size, size) - o[c];
        }
        if (i % 2 && bvh->triangle_count) { /* through some triangle, or its border */
            const struct pen_bvh_triangle *t = &bvh->triangles[random_state % bvh->triangle_count];
            float u = uniform(0, 0.6f), v = uniform(0, 0.5f), reach = uniform(0.8f, 2);
            for (int c = 0; c < 3; c++)
                d[c] = reach * (t->corner[c] + u * t->edge1[c] + v * t->edge2[c] - o[c]);
        }
        if (i % 8 == 0) /* along an axis: infinite inverses */
            d[i / 8 % 3] = d[(i / 8 + 1) % 3] = 0;
        for (uint32_t k = 0; k < bvh->triangle_count && truth != 1; k++) {
            int hit = slow_hit(front_only, &bvh->triangles[k], o, d);
            truth = hit ? hit : truth;
        }
        bool got = pen_bvh_occluded(bvh, front_only, o, d, 1);
        hits += truth == 1;
        close += truth < 0;
        wrong += truth >= 0 && got != truth;
    }
    printf("%u triangles, depth %u, cost %.1f: %d of %d rays hit, %d unsure, %d wrong\n",
        bvh->triangle_count, bvh->depth, (double)bvh->cost, hits, rays, close, wrong);
    CHECK(wrong == 0);
}

enum shape { SOUP, FLAT, SAME, CHAIN, POINTS, SHAPES };

static void make(enum shape shape, struct pen_bvh_triangle *triangles, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        struct pen_bvh_triangle *t = &triangles[i];
        float scale = shape == CHAIN ? powf(0.97f, (float)i) : 1;
        *t = (struct pen_bvh_triangle){.first_index = i, .flags = i % 3 ? 0 : PEN_BVH_TWO_SIDED};
        for (int c = 0; c < 3; c++) {
            t->corner[c] = shape == SAME ? 0 : uniform(-1, 1) * scale;
            t->edge1[c] = uniform(-0.2f, 0.2f) * scale;
            t->edge2[c] = uniform(-0.2f, 0.2f) * scale;
            if (shape == SAME) { /* boxes of one centre */
                static const float same[3][3] = {
                    {-0.1f, 0.2f, 0}, {-0.2f, 0.4f, 0.1f}, {-0.3f, 0, 0.6f}};
                float grown = 1 + 1e-3f * (float)i;
                t->corner[c] = grown * same[c][0];
                t->edge1[c] = grown * same[c][1];
                t->edge2[c] = grown * same[c][2];
            }
            if (shape == POINTS)
                t->edge1[c] = t->edge2[c] = 0;
        }
        if (shape == FLAT)
            t->corner[1] = t->edge1[1] = t->edge2[1] = 0;
    }
}

static void test_shapes(void)
{
    static struct pen_bvh_triangle triangles[3000];
    static const uint32_t counts[] = {0, 1, 2, 5, 64, 3000};
    for (enum shape shape = SOUP; shape < SHAPES; shape++)
        for (size_t k = 0; k < sizeof counts / sizeof *counts; k++) {
            struct pen_bvh bvh;
            struct pen_error error = {0};
            make(shape, triangles, counts[k]);
            CHECK(pen_bvh_build(triangles, counts[k], &bvh, &error));
            check_tree(&bvh);
            check_rays(&bvh, 1000, 1.5f);
            pen_bvh_finish(&bvh);
            pen_bvh_finish(&bvh);
        }
}

/* Two far clusters: the surface-area heuristic must find the gap, halving would not. */
static void test_heuristic(void)
{
    static struct pen_bvh_triangle triangles[1000];
    struct pen_bvh bvh;
    make(SOUP, triangles, 1000);
    for (uint32_t i = 0; i < 100; i++)
        triangles[i].corner[0] += 50;
    CHECK(pen_bvh_build(triangles, 1000, &bvh, NULL));
    const struct pen_bvh_node *left = &bvh.nodes[bvh.nodes[0].first], *right = left + 1;
    CHECK(left->high[0] < 3 && right->low[0] > 48);
    pen_bvh_finish(&bvh);
    /* Rays pay far less than a test of all. */
    make(SOUP, triangles, 1000);
    CHECK(pen_bvh_build(triangles, 1000, &bvh, NULL));
    CHECK(bvh.cost < 120);
    pen_bvh_finish(&bvh);
}

static void test_scene(void)
{
    static const float corners[3][3] = {{0, 0, 0}, {1, 0, 0}, {0, 0, -1}}; /* front is up */
    struct psc_builder *builder = psc_builder_create();
    struct psc_material material = psc_material_default();
    uint32_t materials[4], primitives[4];
    materials[0] = psc_builder_add_material(builder, &material);
    material.flags = PSC_DOUBLE_SIDED;
    material.alpha_mode = PSC_BLEND;
    material.base_color[3] = 0.5f;
    materials[1] = psc_builder_add_material(builder, &material);
    material.base_color[3] = 0;
    materials[2] = psc_builder_add_material(builder, &material); /* casts nothing */
    material.alpha_mode = PSC_MASK;
    material.base_color[3] = 0.5f;
    material.alpha_cutoff = 0.5f;
    materials[3] = psc_builder_add_material(builder, &material); /* is never cut */
    for (int i = 0; i < 4; i++) {
        struct psc_mesh mesh = {
            .positions = corners, .vertex_count = 3, .index_count = 3, .material = materials[i]};
        CHECK(psc_builder_add_mesh(builder, &mesh, &primitives[i], NULL));
    }
    const float place[4][12] = {{1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 1, 0},
        {-1, 0, 0, -5, 0, 1, 0, 1, 0, 0, 1, 0}, {2, 0, 0, 5, 0, 2, 0, 1, 0, 0, 2, 0},
        {1, 0, 0, 9, 0, 1, 0, 1, 0, 0, 1, 0}};
    psc_builder_add_instance(builder, primitives[0], place[0]);
    psc_builder_add_instance(builder, primitives[0], place[1]); /* mirrored */
    psc_builder_add_instance(builder, primitives[1], place[2]);
    psc_builder_add_instance(builder, primitives[2], place[2]);
    psc_builder_add_instance(builder, primitives[3], place[3]);
    static const uint8_t source[PEN_ID_BYTES];
    void *data;
    size_t bytes;
    struct psc_scene scene;
    struct pen_bvh bvh;
    struct pen_error error = {0};
    CHECK(psc_builder_finish(builder, source, &data, &bytes, NULL));
    CHECK(psc_open_memory(data, bytes, &scene, NULL));
    CHECK(pen_bvh_build_scene(&scene, 0, &bvh, NULL));
    CHECK(bvh.triangle_count == 4);
    for (uint32_t i = 0; i < 4; i++) {
        const struct pen_bvh_triangle *t = &bvh.triangles[i];
        static const uint32_t flags[5] = {
            0, PEN_BVH_SWAPPED, PEN_BVH_TWO_SIDED | PEN_BVH_ALPHA, ~0u, PEN_BVH_TWO_SIDED};
        static const uint32_t first[5] = {0, 0, 3, ~0u, 9};
        CHECK(t->flags == flags[t->instance]);
        CHECK(t->first_index == first[t->instance]);
        CHECK(t->edge2[0] * t->edge1[2] - t->edge1[0] * t->edge2[2] > 0); /* front is up */
    }
    const float up[3] = {0, 2, 0}, down[3] = {0, -2, 0};
    const float x[3] = {0.2f, -5.2f, 5.4f};
    for (int i = 0; i < 3; i++) {
        const float low[3] = {x[i], 0, -0.3f}, high[3] = {x[i], 2, -0.3f};
        CHECK(pen_bvh_occluded(&bvh, true, low, up, 1));
        CHECK(!pen_bvh_occluded(&bvh, true, low, up, 0.4f));
        CHECK(pen_bvh_occluded(&bvh, true, high, down, 1) == (i == 2));
        CHECK(pen_bvh_occluded(&bvh, false, high, down, 1));
    }
    pen_bvh_finish(&bvh);
    CHECK(!pen_bvh_build_scene(&scene, 2, &bvh, &error) && error.code == PEN_TOO_BIG);
    free(data);
    psc_builder_destroy(builder);
}

/* After a scene has moved, the refitted tree and one built anew let the same rays through. */
static void compare_moved(struct pen_bvh *moved, const struct psc_scene *scene, bool expected)
{
    struct pen_bvh fresh;
    CHECK(pen_bvh_refit(moved, scene, NULL) == expected);
    CHECK(pen_bvh_build_scene(scene, 0, &fresh, NULL));
    CHECK(fresh.triangle_count == moved->triangle_count);
    int hits = 0, wrong = 0;
    for (int i = 0; i < 4000; i++) {
        float origin[3], direction[3];
        for (int k = 0; k < 3; k++) {
            origin[k] = uniform(-9, 9);
            direction[k] = uniform(-1, 1);
        }
        bool one = pen_bvh_occluded(moved, i % 2, origin, direction, 30);
        hits += one;
        wrong += one != pen_bvh_occluded(&fresh, i % 2, origin, direction, 30);
    }
    printf("moved: %d of 4000 rays hit, %d wrong\n", hits, wrong);
    CHECK(wrong == 0 && hits > 100 && hits < 3900);
    pen_bvh_finish(&fresh);
}

static void test_refit(void)
{
    enum { TRIANGLES = 400 };
    static float corners[3 * TRIANGLES][3];
    for (int t = 0; t < TRIANGLES; t++)
        for (int c = 0; c < 3; c++)
            for (int k = 0; k < 3; k++)
                corners[3 * t + c][k] =
                    c ? corners[3 * t][k] + uniform(-0.4f, 0.4f) : uniform(-2, 2);
    struct psc_builder *builder = psc_builder_create();
    struct psc_material material = psc_material_default();
    struct psc_mesh mesh = {.positions = (const float(*)[3])corners,
        .vertex_count = 3 * TRIANGLES,
        .index_count = 3 * TRIANGLES,
        .material = psc_builder_add_material(builder, &material)};
    uint32_t primitive = 0;
    CHECK(psc_builder_add_mesh(builder, &mesh, &primitive, NULL));
    float worlds[3][12] = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0},
        {-1, 0, 0, 4, 0, 1, 0, 0, 0, 0, 1, 0}, {1, 0, 0, -4, 0, 1, 0, 1, 0, 0, 1, 2}};
    for (int i = 0; i < 3; i++)
        psc_builder_add_instance(builder, primitive, worlds[i]);
    static const uint8_t source[PEN_ID_BYTES];
    void *data;
    size_t bytes;
    struct psc_scene scene;
    struct pen_bvh bvh;
    CHECK(psc_builder_finish(builder, source, &data, &bytes, NULL));
    CHECK(psc_open_memory(data, bytes, &scene, NULL));
    CHECK(pen_bvh_build_scene(&scene, 0, &bvh, NULL));
    struct psc_instance instances[3];
    memcpy(instances, scene.instances, sizeof instances);
    scene.instances = instances;
    compare_moved(&bvh, &scene, true);
    for (int i = 0; i < 3; i++) /* all by a quarter turn around z, and away */
        for (int k = 0; k < 4; k++) {
            float x = instances[i].world[k], y = instances[i].world[4 + k];
            instances[i].world[k] = (float)(k == 3) - y;
            instances[i].world[4 + k] = x;
        }
    compare_moved(&bvh, &scene, true);
    for (int t = 0; t < TRIANGLES; t++) /* neighbours no more: a bad tree, but a right one */
        for (int k = 0; k < 3; k++) {
            float shift = uniform(-4, 4);
            for (int c = 0; c < 3; c++)
                corners[3 * t + c][k] += shift;
        }
    scene.positions = (const float(*)[3])corners;
    compare_moved(&bvh, &scene, false);
    pen_bvh_finish(&bvh);
    free(data);
    psc_builder_destroy(builder);
}

int main(void)
{
    test_refit();
    test_shapes();
    test_heuristic();
    test_scene();
    CHECK_DONE();
}
