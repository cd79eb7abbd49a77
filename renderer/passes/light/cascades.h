/* Cascades over the view distance: where they split, what they see, and their light samples
 * (cascaded soft shadow maps). No GL. */
#pragma once
#include "renderer/light/light.h"
#include "renderer/passes/light/sample_maps.h"

#define CASCADES 3

enum cascade_split {
    CASCADE_SPLIT_PRACTICAL, /* Zhang et al. 2006 */
    CASCADE_SPLIT_PAPER      /* Eq. 5 of the 2023 paper, as printed */
};

/* Borders bounds[0 .. count] of `count` cascades over view distances near_z..far_z, in m and never
 * falling. practical: lambda n (f/n)^(i/m) + (1 - lambda) (n + (f - n) i/m). paper:
 * (n (f/n)^(i/m) + n + (f - n)^(i/m)) / 2, whose first border is n + 1/2: the caller's near cascade
 * begins at near_z all the same. */
void cascade_splits(float near_z, float far_z, uint32_t count, enum cascade_split split,
    float lambda, float *bounds);

enum cascade_weights {
    CASCADE_WEIGHTS_UNIFORM,     /* grid with the corners, 1 / side^2 each */
    CASCADE_WEIGHTS_TRAPEZOID,   /* the same grid, less at the borders */
    CASCADE_WEIGHTS_CELL_CENTRED /* centres of side^2 cells, 1 / side^2 each */
};
/* Coordinate in [-1, 1] and weight of sample i of `side` along one axis; the weights sum to 1. */
void cascade_sample_1d(
    enum cascade_weights mode, uint32_t side, uint32_t i, float *at, float *weight);

/* What a camera's picture is made of, in tiles: reversed depth of the nearest and the farthest
 * receiver; both 0: none. */
struct cascade_tiles {
    const float (*depth)[2];      /* farthest, nearest: width x height */
    uint32_t width, height, size; /* size: px per tile */
};

/* Range of view distances of all receivers that something may shadow; false: there is none. It is
 * rounded outwards so that small moves of the camera keep it. */
bool cascade_range(const struct view *view, const struct light *light,
    const struct cascade_tiles *tiles, float range[2]);

/* Where one face's map plane shows a cascade's receivers from the emitter's centre, and
 * their distances, both in whole steps and rounded outwards: the cascade's maps depend
 * on nothing else. */
struct cascade_bounds {
    int32_t low[3], high[3]; /* x, y: 1/64 of the face's window; z: of how far samples move it */
};
/* Of the receivers between view distances first..last; false: nothing can shadow them. */
bool cascade_bounds(const struct view *view, const struct light_face *face,
    const struct cascade_tiles *tiles, float first, float last, struct cascade_bounds *bounds);

/* The window through which the sample sees those receivers' casters, with a margin for a kernel of
 * `texels` texels of a map of `size` and for the part 1 / side of the emitter that a sample stands
 * for. False: nothing casts there. */
bool cascade_window(const struct light_face *face, const float casters[2][3],
    const struct cascade_bounds *bounds, const float sample[2], uint32_t side, uint32_t texels,
    uint32_t size, float rect[4]);
