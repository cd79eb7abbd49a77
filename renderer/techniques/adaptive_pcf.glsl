// The estimator of adaptive.glsl by depth comparisons.
#include "adaptive.glsl"

// Cells of depth comparisons.
Receiver adaptive_receiver(Surface s)
{
    return receiver_of(s, vec2(textureSize(shadow_map, 0)));
}

int adaptive_window(Receiver r, vec2 extent)
{
    return window_class(r.q, extent, r.plane, r.bias, 0.0, r.map_size);
}

// Four times the taps where the first ones find nothing although the pyramid cannot prove the
// window lit: at the outer edge of a penumbra blockers fill a small part of it.
float adaptive_blocker_depth(
    Receiver r, vec2 extent, vec2 shift, bool wanted, float nearest_z, float receiver_z)
{
    float sum = 0.0, blockers = 0.0;
    for (int round = 0; round < 2; round++) {
        int count = int(P(pcf_search_taps)) << (2 * round);
        Taps taps = taps_begin(count, shift);
        count = wanted && blockers == 0.0 ? count : 0;
        for (int i = 0; i < count; i++) {
            vec2 offset = taps_next(taps) * extent;
            float d = textureLod(shadow_map, light_uv(r.q + offset), 0.0).r;
            if (d < plane_depth(r.plane, offset, r.bias)) {
                sum += light_linear(d);
                blockers += 1.0;
            }
        }
    }
    return blockers > 0.0 ? min(sum / blockers, receiver_z) : receiver_z;
}

float estimate(Receiver r, vec2 offset, vec2 extent, vec2 shift, int level)
{
    int count = max(int(P(pcf_taps)) >> level, 1);
    Taps taps = taps_begin(count, shift);
    float lit = 0.0;
    for (int i = 0; i < count; i++) {
        vec2 at = offset + taps_next(taps) * extent;
        float d = textureLod(shadow_map, light_uv(r.q + at), 0.0).r;
        lit += plane_depth(r.plane, at, r.bias) <= d ? 1.0 : 0.0;
    }
    return lit / float(count);
}
