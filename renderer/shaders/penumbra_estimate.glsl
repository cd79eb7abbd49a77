// Per pixel: hard visibility, and the Gaussian that stands for the light on the screen (s1, skew,
// s2; see screen_spread). What is proved to be lit is left as the target starts: (1, 0, 0, 0).
#include "penumbra.glsl"
#include "blockers.glsl"
#include "light_gauss.glsl"
#include "horizon.glsl"

// Share of the light above the horizon that a receiver sees which turns its back to the light's
// centre: the comparison there says nothing of it.
float turned_lit(Surface s, ReceiverPlane plane, HorizonBack back, vec2 extent, vec2 uv, float bias)
{
    vec2 inverse_size = 1.0 / (light.rect.zw - light.rect.xy);
    float lit = 0.0, all = 0.0;
    int count = back.depth > 0.0 ? P(search_taps) : 0;
    Taps taps = taps_begin(P(search_taps), vec2(0.5));
    for (int i = 0; i < count; i++) {
        vec2 e = taps_next(taps), offset = e * extent;
        float d = texture(shadow_map, uv + offset * inverse_size).r;
        bool blocked = d < plane_depth(plane, offset, bias) && d > back_depth(back, offset);
        float above = horizon_height(s.p, s.n, e) > 0.0 ? 1.0 : 0.0;
        lit += blocked ? 0.0 : above;
        all += above;
    }
    return lit / max(all, 1.0);
}

vec4 visibility(Surface s)
{
    vec2 q = light_project(s.p), texel = light_texel(shadow_map);
    ReceiverPlane plane = receiver_plane(s.p, s.n);
    float bias = P(bias) * s.p.z * light_depth_slope(s.p.z), depth;
    vec2 least = max(P(min_filter), 0.25) * texel;
    BlockerSearch search = blocker_window(s, plane, q, least, bias);
    if (search.lit)
        discard;
    vec2 extent = blocker_extent(s, plane, search, light_uv(q), least, bias);
    HorizonBack back = horizon_back(s.p, s.n, bias);
    float turned = turned_lit(s, plane, back, search.extent, light_uv(q), bias);
    float hard = hard_lit(s, plane, q, texel, bias, depth) ? 1.0 : 0.0;
    vec3 spread = screen_spread(
        pixels_per_map(s), light_gauss_deviation * extent, light_gauss_deviation * float(P(max_radius)));
    // All zeros are left to receivers that no part of the light can reach.
    return vec4(back.depth > 0.0 ? turned : hard, spread.xy, max(spread.z, 1e-3));
}
