// What the min-max pyramid knows of a receiver's blockers.
#include "min_max.glsl"
#include "hard_lit.glsl"

struct BlockerSearch {
    vec2 extent;     // half extents of the window that holds all blockers, on the map plane
    float nearest_z; // in the window
    bool lit;        // proved: nothing in the window is nearer than the receiver
    bool dark;       // everything in it is
};

BlockerSearch blocker_window(Surface s, ReceiverPlane plane, vec2 q, vec2 least, float bias)
{
    BlockerSearch search;
    search.extent = min_max_search_extent(q, s.p.z, least, search.nearest_z);
    // Past the far plane of the map lies nothing but empty texels, at the far plane's depth.
    search.lit = search.nearest_z >= min(s.p.z, 0.9995 * light.far_z);
    float farthest = light_depth(min_max_window(q, search.extent).y);
    search.dark = farthest < min(plane.depth - dot(abs(plane.gradient), search.extent), 1.0) - bias;
    return search;
}
