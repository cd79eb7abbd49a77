// The blocker search of percentage-closer soft shadows (Fernando 2005), bounded by the min-max
// pyramid. Needs P(search_taps).
#include "taps.glsl"
#include "blocker_window.glsl"

// Half extents on the map plane of the light's image by the average blocker; by the nearest when
// all taps miss what the pyramid knows to be there. 0 where all of the light is hidden, so that
// there is nothing to filter.
vec2 blocker_extent(
    Surface s, ReceiverPlane plane, BlockerSearch search, vec2 uv, vec2 least, float bias)
{
    vec2 inverse_size = 1.0 / (light.rect.zw - light.rect.xy);
    int count = search.lit || search.dark ? 0 : int(P(search_taps));
    Taps taps = taps_begin(int(P(search_taps)), vec2(0.5));
    float sum = 0.0, blockers = 0.0;
    for (int i = 0; i < count; i++) {
        vec2 offset = taps_next(taps) * search.extent;
        float d = texture(shadow_map, uv + offset * inverse_size).r;
        if (d < plane_depth(plane, offset, bias)) {
            sum += light_linear(d);
            blockers += 1.0;
        }
    }
    float z = blockers > 0.0 ? sum / blockers : search.nearest_z;
    return count > 0 ? max(light_filter_extent(min(z, s.p.z), s.p.z), least) : vec2(0.0);
}
