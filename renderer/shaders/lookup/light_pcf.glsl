// Percentage-closer filtering in which a tap stands for the point of the light that it can hide
// (F2): those below the receiver's horizon are left out of the mean.
#include "taps.glsl"
#include "horizon.glsl"

// Share that is lit of the part of the light above the horizon, out of `taps` comparisons over
// q +- extent; 1 when `count`, which is `taps` or 0, is 0. `uv`: of q. The loop's bound is dynamic
// so that software rasterisers skip it.
float light_pcf(Surface s, ReceiverPlane plane, HorizonBack back, vec2 uv, vec2 extent, float bias,
    int count, int taps, vec2 shift)
{
    vec2 inverse_size = 1.0 / (light.rect.zw - light.rect.xy);
    float lit = 0.0, all = 0.0;
    Taps t = taps_begin(taps, shift);
    for (int i = 0; i < count; i++) {
        vec2 e = taps_next(t), offset = e * extent;
        float d = texture(shadow_map, uv + offset * inverse_size).r;
        bool blocked = d < plane_depth(plane, offset, bias);
        bool seen = d > back_depth(back, offset) && horizon_height(s.p, s.n, e) > 0.0;
        float above = seen ? 1.0 : 0.0;
        lit += blocked ? 0.0 : above;
        all += above;
    }
    return count > 0 ? lit / max(all, 1.0) : 1.0;
}
