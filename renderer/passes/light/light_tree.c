#include "renderer/passes/light/light_tree.h"
#include <assert.h>
#include <string.h>

void light_tree_corners(const struct light_quad *quad, uint32_t corners[4])
{
    uint32_t side = 16u >> quad->level;
    for (uint32_t i = 0; i < 4; i++)
        corners[i] = (quad->y + (i >> 1) * side) * LIGHT_TREE_SIDE + quad->x + (i & 1) * side;
}

static uint32_t add_quad(struct light_tree *tree, uint32_t x, uint32_t y, uint32_t level)
{
    uint32_t corners[4], added = 0;
    assert(tree->count < LIGHT_TREE_QUADS);
    struct light_quad *quad = &tree->quads[tree->count++];
    *quad = (struct light_quad){(uint8_t)x, (uint8_t)y, (uint8_t)level, false};
    light_tree_corners(quad, corners);
    for (int i = 0; i < 4; i++) {
        added += !tree->used[corners[i]];
        tree->used[corners[i]] = true;
    }
    tree->used_count += added;
    return added;
}

void light_tree_begin(struct light_tree *tree)
{
    memset(tree, 0, sizeof *tree);
    add_quad(tree, 0, 0, 0);
}

uint32_t light_tree_split(struct light_tree *tree, uint32_t quad)
{
    const struct light_quad parent = tree->quads[quad];
    uint32_t half = 8u >> parent.level, added = 0;
    assert(quad < tree->count && !parent.split && parent.level < LIGHT_TREE_LEVELS);
    tree->quads[quad].split = true;
    for (uint32_t i = 0; i < 4; i++)
        added += add_quad(
            tree, parent.x + (i & 1) * half, parent.y + (i >> 1) * half, parent.level + 1u);
    return added;
}

void light_tree_weights(const struct light_tree *tree, float weights[LIGHT_TREE_POINTS])
{
    memset(weights, 0, LIGHT_TREE_POINTS * sizeof *weights);
    for (uint32_t q = 0; q < tree->count; q++) {
        uint32_t corners[4];
        if (tree->quads[q].split)
            continue;
        light_tree_corners(&tree->quads[q], corners);
        for (int i = 0; i < 4; i++) /* powers of two: the sum is exact */
            weights[corners[i]] += 0.25f / (float)(1u << 2 * tree->quads[q].level);
    }
}

uint32_t light_tree_level(uint32_t point)
{
    uint32_t bits = point % LIGHT_TREE_SIDE | point / LIGHT_TREE_SIDE | 16, level = 4;
    for (; !(bits & 1); bits >>= 1)
        level--;
    return level;
}

static uint32_t page_of(uint32_t point)
{
    uint32_t x = point % LIGHT_TREE_SIDE, y = point / LIGHT_TREE_SIDE;
    uint32_t level = light_tree_level(point);
    if (level < 3)
        return level == 2;
    /* Blocks of the level's own grid; the last one also takes the border. */
    uint32_t blocks = level == 3 ? 2 : 4, last = blocks - 1, size = 16 / blocks;
    uint32_t i = x / size < last ? x / size : last, j = y / size < last ? y / size : last;
    return light_pages(level - 1) + j * blocks + i;
}

uint32_t light_pages(uint32_t level)
{
    static const uint32_t pages[] = {1, 1, 2, 6, LIGHT_PAGES};
    return pages[level];
}

/* Filled on first use, by the one thread that renders. */
static struct light_page pages[LIGHT_PAGES];
static uint16_t places[LIGHT_TREE_POINTS];

static void make_pages(void)
{
    if (pages[0].count)
        return;
    for (uint32_t point = 0; point < LIGHT_TREE_POINTS; point++) {
        uint32_t number = page_of(point);
        struct light_page *page = &pages[number];
        assert(page->count < 16);
        places[point] = (uint16_t)(16 * number + page->count);
        page->points[page->count++] = (uint16_t)point;
    }
}

const struct light_page *light_page(uint32_t number)
{
    make_pages();
    return &pages[number];
}

uint32_t light_page_place(uint32_t point)
{
    make_pages();
    return places[point];
}
