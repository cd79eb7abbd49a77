// The hard shadow buffer of Klein et al. 2014: (lit, W of the blocker, bound of W, reach). W is F2's
// window scale, which takes the light's extent to the map plane and so stands for blocker and
// receiver depth in one; it is negative where the silhouette test of variant direct fails. Bound: no
// blocker of this receiver has a larger W; 0 where everything blocks. Reach: pixels that W = 1 makes
// of the light's half extent, at most. What is proved to be lit is left as the target starts:
// (1, 0, 0, 0).
#include "penumbra.glsl"
#include "blocker_window.glsl"

vec4 visibility(Surface s)
{
    vec2 q = light_project(s.p), texel = light_texel(shadow_map);
    ReceiverPlane plane = receiver_plane(s.p, s.n);
    float bias = P(bias) * s.p.z * light_depth_slope(s.p.z), depth;
    BlockerSearch search = blocker_window(s, plane, q, texel, bias);
    if (search.lit)
        discard;
    bool lit = hard_lit(s, plane, q, texel, bias, depth);
    float bound = search.dark ? 0.0 : light_window_scale(min(search.nearest_z, s.p.z), s.p.z);
    mat2 pixels = pixels_per_map(s);
    bool silhouette = true;
#if P_variant == 1
    // An edge of the shadow belongs to a silhouette when light passes within the pixel's footprint;
    // where an object in front merely ends, all of the footprint is blocked.
    mat2 map = inverse(pixels);
    vec2 foot = 1.5 * (abs(map[0]) + abs(map[1])) + texel;
    silhouette = light_depth(min_max_window(q, foot).y) >=
        min(plane.depth - dot(abs(plane.gradient), foot), 1.0) - bias;
#endif
    float w = light_window_scale(min(light_linear(depth), s.p.z), s.p.z);
    vec2 x = abs(pixels[0]) * light.extent.x, y = abs(pixels[1]) * light.extent.y;
    float reach = min(max(x.x + y.x, x.y + y.y), 60000.0);
    return vec4(lit ? 1.0 : 0.0, lit ? 0.0 : silhouette ? w : -w, bound, reach);
}
