/* Depth maps seen from points of the emitter, as layers of an array: parallel frusta through the
 * same plane, each with the window that fits its casters. */
#pragma once
#include "renderer/passes/passes.h"

#define SAMPLE_MAP_BATCH 16

struct sample_point {
    float at[2]; /* emitter coordinates, m (parallel: tangents) */
    float uv[2]; /* the same in [-1, 1]^2 */
};

/* `count` points of the Hammersley set (radical inverse in base 2) over the face's emitter; a disk
 * by the concentric map of Shirley and Chiu 1997. */
void sample_points(const struct light_face *face, uint32_t count, struct sample_point *points);

/* What the lookup needs per sample; std140 array element. */
struct sample_map {
    float at[4]; /* xy: emitter position; z: 1 when the layer is used */
    float
        window[4]; /* map uv = l * window.xy + window.zw, l on the map plane seen from the sample */
    float emission[4];
};

/* The maps of points[0 .. count), count <= SAMPLE_MAP_BATCH, size x size, D32F layers of
 * (*maps)->textures[0]. Kept between requests when `keep`, else in scratch memory that the next
 * call reuses. `number` tells batches of one set apart. Fills table[count]. */
bool pass_sample_maps(struct technique_run *run, const struct sample_point *points, uint32_t count,
    uint32_t size, uint32_t number, bool keep, struct sample_map *table,
    const struct gl_texture **maps, struct pen_error *error);
