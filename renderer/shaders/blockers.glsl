// The blocker search of percentage-closer soft shadows (Fernando 2005), bounded by the min-max
// pyramid. Needs P(search_taps). OR_NEAREST: where all taps miss what the pyramid knows to be there,
// its nearest depth counts.
#include "taps.glsl"
#include "min_max.glsl"
#include "hard_lit.glsl"

// Half extents on the map plane of the light's image by the average blocker; 0 where nothing blocks
// or where all of the light is hidden, so that there is nothing to filter. `least`: its lower bound.
vec2 blocker_extent(Surface s, ReceiverPlane plane, vec2 q, vec2 least, float bias, vec2 shift)
{
    vec2 inverse_size = 1.0 / (light.rect.zw - light.rect.xy), uv = light_uv(q);
    float nearest_z;
    vec2 search = min_max_search_extent(q, s.p.z, least, nearest_z);
    vec2 slope = abs(plane.gradient) * search;
    float reach = slope.x + slope.y;
    bool lit = light_depth(nearest_z) >= min(plane.depth + reach, 1.0);
    bool dark = light_depth(min_max_window(q, search).y) <
        min(plane.depth - reach, 1.0) - bias;
    int count = nearest_z < s.p.z && !lit && !dark ? P(search_taps) : 0;
    Taps taps = taps_begin(P(search_taps), shift);
    float sum = 0.0, blockers = 0.0;
    for (int i = 0; i < count; i++) {
        vec2 offset = taps_next(taps) * search;
        float d = texture(shadow_map, uv + offset * inverse_size).r;
        if (d < plane_depth(plane, offset, bias)) {
            sum += light_linear(d);
            blockers += 1.0;
        }
    }
#ifdef OR_NEAREST
    if (blockers == 0.0 && count > 0) {
        sum = nearest_z;
        blockers = 1.0;
    }
#endif
    if (blockers == 0.0)
        return vec2(0.0);
    return max(light_filter_extent(min(sum / blockers, s.p.z), s.p.z), least);
}
