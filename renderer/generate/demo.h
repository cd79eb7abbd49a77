/* The things that stand in the demo; private to it. */
#pragma once
#include "renderer/generate/shape.h"

/* Branches of a tree of about 2.6 m that stands on the origin, and its leaves. */
void shape_tree(struct shape *wood, struct shape *leaves, uint64_t seed);
/* An iron fence from (0,0,0) to (length,0,0), `height` to the tips of its bars. */
void shape_fence(struct shape *shape, double length, double height, double spacing);
/* A globe of thin rings on a stand; the rings' centre is at `height`. */
void shape_armillary(struct shape *shape, double height, double radius);
/* A (2,3) torus knot around the origin, about 2 * size wide. */
void shape_knot(struct shape *shape, double size, double thickness);
void shape_sphere(struct shape *shape, double radius, uint32_t rows);
/* Stone blocks in courses, with open joints over a solid core: x 0..length, z -depth/2..depth/2. */
void shape_wall(struct shape *shape, double length, double height, double depth, uint64_t seed);
/* Two piers and a round arch of wedge stones, `span` clear, springing at `spring`. */
void shape_arch(struct shape *shape, double span, double spring, double depth);
