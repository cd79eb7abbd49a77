/* Alpha of MASK and BLEND materials as ray_alpha.glsl reads it. No GL. */
#pragma once
#include "renderer/trace/bvh.h"

/* struct ray_alpha_triangle */
#define SHARED_ROWS "renderer/shaders/rays/ray_alpha.def"
#include "renderer/shared/rows_c.h"

struct ray_alpha {
    struct ray_alpha_triangle *triangles;
    uint32_t *words; /* eight per material, then the texels' alpha, four to a word */
    uint32_t triangle_count;
    uint64_t word_count;
};

/* Fills *alpha and, in triangles with PEN_BVH_ALPHA, replaces first_index by the number of their
 * record. Records are numbered in the order of instances and of their triangles. Errors:
 * PEN_TOO_BIG above `max_bytes` in either array, PEN_INTERNAL. */
bool ray_alpha_make(const struct psc_scene *scene, struct pen_bvh *bvh, uint64_t max_bytes,
    struct ray_alpha *alpha, struct pen_error *error);
void ray_alpha_finish(struct ray_alpha *alpha); /* harmless on a zeroed one */
