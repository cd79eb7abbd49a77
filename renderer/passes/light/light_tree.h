/* The quadtree over an emitter of adaptive light sampling (Schwaerzler et al. 2012): samples are
 * the corners of its leaves, on a grid of 17 x 17 points. No GL. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#define LIGHT_TREE_LEVELS 4
#define LIGHT_TREE_SIDE 17
#define LIGHT_TREE_POINTS (LIGHT_TREE_SIDE * LIGHT_TREE_SIDE)
#define LIGHT_TREE_QUADS 341 /* 1 + 4 + 16 + 64 + 256 */

struct light_quad {
    uint8_t x, y, level; /* lower corner on the grid; its side is 16 >> level */
    bool split;
};

struct light_tree {
    struct light_quad quads[LIGHT_TREE_QUADS]; /* parents before children */
    uint32_t count;
    bool used[LIGHT_TREE_POINTS]; /* point y * LIGHT_TREE_SIDE + x is a corner of some quad */
    uint32_t used_count;
};

/* One quad with the emitter's four corners. */
void light_tree_begin(struct light_tree *tree);
/* Replaces a leaf above the last level by four. Returns how many points are new (0 to 5). */
uint32_t light_tree_split(struct light_tree *tree, uint32_t quad);
/* Points of a quad: (0,0) (1,0) (0,1) (1,1). */
void light_tree_corners(const struct light_quad *quad, uint32_t corners[4]);
/* A leaf with a share A of the area gives A / 4 to each corner; the sum is 1 for any tree. Points
 * that are no corner of a leaf get 0. */
void light_tree_weights(const struct light_tree *tree, float weights[LIGHT_TREE_POINTS]);

/* The level that a point first appears in. */
uint32_t light_tree_level(uint32_t point);

/* Points in pages of at most 16 neighbours of one level (levels 0 and 1 share the first), so that
 * what a page holds does not depend on the tree. */
#define LIGHT_PAGES 22
struct light_page {
    uint16_t points[16];
    uint32_t count;
};
/* Pages that levels 0 .. level need: 1, 1, 2, 6, 22. */
uint32_t light_pages(uint32_t level);
const struct light_page *light_page(uint32_t number);
/* Where a point is: page number * 16 + place in it. */
uint32_t light_page_place(uint32_t point);
