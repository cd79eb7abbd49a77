/* A bounding volume hierarchy over a scene's triangles, built on the CPU without any library and
 * laid out for a shader: both arrays go into storage buffers as they are (std430).
 *
 * Node 0 is the root. count 0: an inner node whose children are nodes first and first + 1; else a
 * leaf of triangles first .. first + count - 1. A stack of PEN_BVH_STACK entries is enough for a
 * traversal that pushes the farther child. pen_bvh_occluded is the traversal to copy in GLSL. */
#pragma once
#include "renderer/blob/pscene.h"

/* struct pen_bvh_node, struct pen_bvh_triangle */
#define SHARED_ROWS "renderer/trace/bvh.def"
#include "renderer/shared/rows_c.h"

struct pen_bvh {
    struct pen_bvh_node *nodes;         /* at least one: an empty scene has an empty leaf */
    struct pen_bvh_triangle *triangles; /* in leaf order */
    uint32_t node_count, triangle_count;
    uint32_t depth; /* of the deepest leaf, root 0; below PEN_BVH_STACK */
    float cost;     /* expected node and triangle tests of a ray that hits the root box, as built */
};

/* The triangles of all instances that can cast (casters.h). Binned surface-area heuristic (Wald
 * 2007), one thread: about one second per million triangles. Errors: PEN_TOO_BIG above
 * `max_triangles` (0: 2^26). */
bool pen_bvh_build_scene(const struct psc_scene *scene, uint64_t max_triangles, struct pen_bvh *bvh,
    struct pen_error *error);
/* The same over `count` triangles of the caller's, which are copied. */
bool pen_bvh_build(const struct pen_bvh_triangle *triangles, uint32_t count, struct pen_bvh *bvh,
    struct pen_error *error);
/* The scene's vertices and instances moved: gives each node its new box, in the tree that is there.
 * `first_indices`: of the triangles in PSC_INDICES, where first_index says something else by now;
 * NULL: it does not. False when a walk has become so much dearer that building anew pays; the boxes
 * are right all the same. The scene has the instances and primitives that the tree was made of. */
bool pen_bvh_refit(
    struct pen_bvh *bvh, const struct psc_scene *scene, const uint32_t *first_indices);
void pen_bvh_finish(struct pen_bvh *bvh); /* harmless on a zeroed one */

/* Whether a triangle lies on origin + t direction, 0 < t < limit, under the rule of shadows:
 * front_only, a single-sided triangle counts when its front faces along the direction, that is the
 * light. Alpha is not looked at. */
bool pen_bvh_occluded(const struct pen_bvh *bvh, bool front_only, const float origin[3],
    const float direction[3], float limit);
