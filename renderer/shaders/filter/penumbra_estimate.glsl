// Per pixel: hard visibility, and the Gaussian that stands for the light on the screen (s1, skew,
// s2; see screen_spread). What is proved to be lit is left as the target starts: (1, 0, 0, 0).
#include "penumbra.glsl"
#include "blockers.glsl"
#include "light_gauss.glsl"
#include "light_pcf.glsl"

vec4 visibility(Surface s)
{
    vec2 q = light_project(s.p), texel = light_texel(shadow_map);
    ReceiverPlane plane = receiver_plane(s.p, s.n);
    float bias = surface_bias(s, P(bias)) * light_depth_slope(s.p.z), depth;
    vec2 least = max(P(min_filter), 0.25) * texel;
    BlockerSearch search = blocker_window(s, plane, q, least, bias);
    if (search.lit)
        discard;
    vec2 extent = blocker_extent(s, plane, search, light_uv(q), least, bias);
    HorizonBack back = horizon_back(s.p, s.n, bias);
    // The comparison says nothing of a receiver that turns its back to the light's centre.
    int count = back.depth > 0.0 ? int(P(search_taps)) : 0;
    float turned = light_pcf(
        s, plane, back, light_uv(q), search.extent, bias, count, int(P(search_taps)), vec2(0.5));
    float hard = hard_lit(s, plane, q, texel, bias, depth) ? 1.0 : 0.0;
    vec3 spread = screen_spread(pixels_per_map(s), light_gauss_deviation * extent,
        light_gauss_deviation * float(P(max_radius)));
    // All zeros are left to receivers that no part of the light can reach.
    return vec4(back.depth > 0.0 ? turned : hard, spread.xy, max(spread.z, 1e-3));
}
