// Whether anything casts on a ray: struct pen_bvh of renderer/trace/bvh.h and the walk of
// pen_bvh_occluded over it. A triangle with alpha is asked through
//     bool ray_alpha_hit(uint record, vec2 uv)
// of the includer when ALPHA is defined. FRONT_ONLY: casters are asked for by their front.
#include "bvh.def"

const float BVH_MISS = 3e38;

// Where the ray enters the node's box; BVH_MISS when it does not before `limit`.
float bvh_enter(uint node, vec3 origin, vec3 inverse, float limit)
{
    vec3 a = (bvh_nodes[node].low - origin) * inverse;
    vec3 b = (bvh_nodes[node].high - origin) * inverse;
    vec3 low = min(a, b), high = max(a, b);
    float near = max(max(0.0, low.x), max(low.y, low.z));
    float far = min(min(limit, high.x), min(high.y, high.z));
    return near <= far * 1.0000005 ? near : BVH_MISS; // rounding must not lose a box
}

// Moeller and Trumbore 1997. FRONT_ONLY: a single-sided triangle counts when its
// front faces along the ray.
bool bvh_hits(uint triangle, vec3 origin, vec3 direction, float limit)
{
    BvhTriangle t = bvh_triangles[triangle];
    vec3 p = cross(direction, t.edge2), s = origin - t.corner, q = cross(s, t.edge1);
    float determinant = dot(t.edge1, p); // positive when the ray meets the front
    if (determinant == 0.0)
        return false;
#ifdef FRONT_ONLY
    if (determinant > 0.0 && (t.flags & PEN_BVH_TWO_SIDED) == 0u)
        return false;
#endif
    float u = dot(s, p) / determinant, v = dot(direction, q) / determinant;
    float at = dot(t.edge2, q) / determinant;
    if (!(u >= 0.0 && v >= 0.0 && u + v <= 1.0 && at > 0.0 && at < limit))
        return false;
#ifdef ALPHA
    if ((t.flags & PEN_BVH_ALPHA) != 0u)
        return ray_alpha_hit(t.first_index, vec2(u, v));
#endif
    return true;
}

bool bvh_cut = false; // some walk was not finished: its answer means nothing

// `nodes`: how many there are, 0 for an empty scene. A walk visits none twice, so that is the most
// steps that it may take, whatever the buffers hold. A driver may allow fewer: llvmpipe leaves all
// loops of an invocation when they have turned 65535 times together.
bool bvh_occluded(vec3 origin, vec3 direction, float limit, uint nodes)
{
    uint stack[PEN_BVH_STACK], at = 0u;
    int waiting = 0;
    vec3 safe = mix(direction, vec3(1e-20), lessThanEqual(abs(direction), vec3(1e-20)));
    vec3 inverse = 1.0 / safe;
    if (nodes == 0u || bvh_enter(0u, origin, inverse, limit) == BVH_MISS)
        return false;
    for (uint steps = 0u; steps < nodes; steps++) {
        uint first = bvh_nodes[at].first, count = bvh_nodes[at].count;
        bool inner = count == 0u;
        for (uint i = 0u; i < min(count, PEN_BVH_LEAF); i++)
            if (bvh_hits(first + i, origin, direction, limit))
                return true;
        float left = BVH_MISS, right = BVH_MISS;
        if (inner) {
            left = bvh_enter(first, origin, inverse, limit);
            right = bvh_enter(first + 1u, origin, inverse, limit);
        }
        bool swapped = right < left;
        if (left != BVH_MISS && right != BVH_MISS && waiting < PEN_BVH_STACK)
            stack[waiting++] = swapped ? first : first + 1u;
        if (left != BVH_MISS || right != BVH_MISS) {
            at = swapped ? first + 1u : first;
            continue;
        }
        if (waiting == 0)
            return false;
        at = stack[--waiting];
    }
    bvh_cut = true;
    return false;
}
