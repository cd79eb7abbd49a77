/* The quadtree over a light: weights, points and their pages, for random trees. */
#include "renderer/passes/light/light_tree.h"
#include "tests/unit/check.h"

static uint32_t seed = 7;

static uint32_t random_below(uint32_t n)
{
    seed = seed * 1664525u + 1013904223u;
    return (uint32_t)((uint64_t)(seed >> 8) * n >> 24);
}

/* The integral of x^i y^j over [0, 16]^2 / 256 by the tree's weights: exact for polynomials that
 * are linear in each variable, whatever the tree. */
static void check_weights(const struct light_tree *tree)
{
    float weights[LIGHT_TREE_POINTS];
    double sum = 0, x = 0, y = 0, xy = 0;
    uint32_t used = 0;
    light_tree_weights(tree, weights);
    for (uint32_t i = 0; i < LIGHT_TREE_POINTS; i++) {
        double w = (double)weights[i];
        CHECK((w > 0) == tree->used[i]);
        used += tree->used[i];
        sum += w;
        x += w * (i % LIGHT_TREE_SIDE);
        y += w * (i / LIGHT_TREE_SIDE);
        xy += w * (i % LIGHT_TREE_SIDE) * (i / LIGHT_TREE_SIDE);
    }
    CHECK(sum == 1);
    CHECK(used == tree->used_count);
    CHECK_NEAR(x, 8, 1e-6);
    CHECK_NEAR(y, 8, 1e-6);
    CHECK_NEAR(xy, 64, 1e-5);
}

static void check_full_levels(void)
{
    static const uint32_t expected[] = {4, 9, 25, 81, 289};
    struct light_tree tree;
    light_tree_begin(&tree);
    for (uint32_t level = 0; level <= LIGHT_TREE_LEVELS; level++) {
        CHECK(tree.used_count == expected[level]);
        check_weights(&tree);
        for (uint32_t q = 0, n = tree.count; level < LIGHT_TREE_LEVELS && q < n; q++)
            if (tree.quads[q].level == level)
                light_tree_split(&tree, q);
    }
    CHECK(tree.count == LIGHT_TREE_QUADS);
}

static void check_random(void)
{
    for (int t = 0; t < 300; t++) {
        struct light_tree tree;
        light_tree_begin(&tree);
        for (uint32_t splits = random_below(85); splits; splits--) {
            uint32_t q = random_below(tree.count);
            if (tree.quads[q].split || tree.quads[q].level == LIGHT_TREE_LEVELS)
                continue;
            uint32_t before = tree.used_count;
            CHECK(before + light_tree_split(&tree, q) == tree.used_count);
        }
        check_weights(&tree);
    }
}

static void check_pages(void)
{
    uint32_t seen[LIGHT_TREE_POINTS] = {0};
    for (uint32_t number = 0; number < LIGHT_PAGES; number++) {
        const struct light_page *page = light_page(number);
        CHECK(page->count > 0 && page->count <= 16);
        for (uint32_t i = 0; i < page->count; i++) {
            uint32_t point = page->points[i], level = light_tree_level(point);
            seen[point]++;
            CHECK(light_page_place(point) == 16 * number + i);
            CHECK(number < light_pages(level));
            CHECK(level < 2 || number >= light_pages(level - 1));
            /* Not on the grid of the level above, but on its own. */
            uint32_t x = point % LIGHT_TREE_SIDE, y = point / LIGHT_TREE_SIDE, step = 16u >> level;
            CHECK(x % step == 0 && y % step == 0);
            CHECK(level == 0 || x % (2 * step) || y % (2 * step));
        }
    }
    for (uint32_t i = 0; i < LIGHT_TREE_POINTS; i++)
        CHECK(seen[i] == 1);
    CHECK(light_page(0)->count == 9); /* bits 9 to 15 of the first page are free for flags */
}

int main(void)
{
    check_full_levels();
    check_random();
    check_pages();
    CHECK_DONE();
}
