// Fernando 2005 with exact projections (F3, F4) and the receiver's plane.
#include "light_pcf.glsl"
#include "min_max.glsl"

vec4 visibility(Surface s)
{
    vec2 q = light_project(s.p), texel = light_texel(shadow_map);
    vec2 inverse_size = 1.0 / (light.rect.zw - light.rect.xy), uv = light_uv(q);
    ReceiverPlane plane = receiver_plane(s.p, s.n);
    // A tap lands anywhere in its texel, whose depth is that of its centre: half a texel along the
    // plane's slope is the most they can differ by on the receiver itself.
    float bias =
        surface_bias(s, P(bias)) * light_depth_slope(s.p.z) + 0.5 * dot(abs(plane.gradient), texel);
    HorizonBack back = horizon_back(s.p, s.n, bias);
    vec2 shift = P(smooth) ? frame_shift(s.pixel) : vec2(0.5);

    float nearest_z;
    vec2 search = min_max_search_extent(q, s.p.z, texel, nearest_z);
    int search_count = nearest_z < s.p.z ? int(P(search_taps)) : 0;
    Taps taps = taps_begin(int(P(search_taps)), shift);
    float sum = 0.0, blockers = 0.0;
    for (int i = 0; i < search_count; i++) {
        vec2 offset = taps_next(taps) * search;
        float d = texture(shadow_map, uv + offset * inverse_size).r;
        if (d < plane_depth(plane, offset, bias) && d > back_depth(back, offset)) {
            sum += light_linear(d);
            blockers += 1.0;
        }
    }
    // The filter runs zero times where nothing blocks: a dynamic bound skips it, a return would not
    // (software rasterisers run all lanes to the end).
    float caster_z = min(sum / max(blockers, 1.0), s.p.z);
    vec2 extent = max(light_filter_extent(caster_z, s.p.z), P(min_filter) * texel);
    int count = blockers > 0.0 ? int(P(filter_taps)) : 0;
    float v = light_pcf(s, plane, back, uv, extent, bias, count, int(P(filter_taps)), shift);
#ifdef INTERLEAVED
    // Width of the penumbra on the screen, F5, for the averaging pass.
    float scale = light_parallel ? 1.0 : s.p.z / light.near_z;
    float pixels = 2.0 * extent.x * scale * view.eye.w * s.depth / view.forward.w;
    return vec4(v, count > 0 ? pixels : 0.0, 0.0, 1.0);
#else
    return scalar_visibility(v);
#endif
}
