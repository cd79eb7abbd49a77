// The hard shadow buffer of Klein et al. 2014: (lit, W of the blocker, bound of W, reach). W is the
// window scale of erosion_window.glsl, which stands for blocker and receiver depth in one and is
// the same in all faces of a cube; it is negative where the silhouette test of variant direct
// fails. Bound: no blocker of this receiver has a larger W; 0 where everything blocks. Reach:
// pixels that W = 1 makes of the light's half extent, at most. What is proved to be lit is left as
// the target starts: (1, 0, 0, 0).
#include "penumbra.glsl"
#include "erosion_window.glsl"
#include "blocker_window.glsl"

vec4 visibility(Surface s)
{
    vec2 q = light_project(s.p), texel = light_texel(shadow_map);
    ReceiverPlane plane = receiver_plane(s.p, s.n);
    float bias = surface_bias(s, P(bias)) * light_depth_slope(s.p.z), depth;
    BlockerSearch search = blocker_window(s, plane, q, texel, bias);
    if (search.lit)
        discard;
    bool lit = hard_lit(s, plane, q, texel, bias, depth);
    float bound = search.dark ? 0.0 : window_scale(min(search.nearest_z, s.p.z), s.p.z);
    mat2 pixels = pixels_per_map(s);
    bool silhouette = true;
    if (P(variant) == VARIANT_DIRECT) {
        // An edge of the shadow belongs to a silhouette when the 3 x 3 Laplacian finds it in the
        // shadow map too, a pixel of the receiver's own plane to each side; where an object in
        // front merely ends, all of them are blocked.
        mat2 map = inverse(pixels);
        silhouette = false;
        for (int i = 0; i < 4; i++) {
            vec2 offset = (i & 1) == 0 ? map[i >> 1] : -map[i >> 1];
            float d = texture(shadow_map, light_uv(q + offset)).r;
            silhouette = silhouette || plane_depth(plane, offset, bias) <= d;
        }
    }
    float w = window_scale(min(light_linear(depth), s.p.z), s.p.z);
    vec2 x = abs(pixels[0]) * window_extent.x, y = abs(pixels[1]) * window_extent.y;
    float reach = min(max(x.x + y.x, x.y + y.y), 60000.0);
    return vec4(lit ? 1.0 : 0.0, lit ? 0.0 : silhouette ? w : -w, bound, reach);
}
