// Peters et al. 2017: percentage-closer soft shadows whose blocker search and filter each solve one
// moment problem, for the means of four moments over a window of a summed-area table.
#include "moments.glsl"
#include "classify.glsl"
#include "sat.glsl"

// Moments of depth in [-1, 1] over [low, high], texels of the table.
vec4 window_moments(vec2 low, vec2 high, bool exact)
{
    vec4 packed_mean;
    if (exact) {
        packed_mean = sat_mean(low, high);
    } else {
        ivec2 a = ivec2(low), b = min(ivec2(ceil(high)), int(sat_info.side));
        packed_mean = sat_mean_whole(a, max(b, a + 1));
    }
    return moments_bias(moments_unpack(packed_mean), P(moment_bias));
}

// Share of blockers (x) and that times their mean depth (y) in a part of the window.
vec2 part_blockers(vec2 low, vec2 high, bool exact, vec2 q, ReceiverPlane plane, float bias)
{
    vec2 texel = sat_texel();
    vec2 offset = 0.5 * (low + high) * texel + light.rect.xy - q;
    PlaneInWindow t = plane_in_window(plane, offset, 0.5 * (high - low) * texel, bias);
    // A slope may shadow itself: it can be compared with a nearer part of it.
    float depth = 2.0 * mix(t.mean, t.lowest, P(kernel_bias)) - 1.0;
    vec2 blockers = moment_blockers(window_moments(low, high, exact), depth, 1e-3);
    return vec2(blockers.x, blockers.x * clamp(blockers.y, -1.0, depth));
}

vec4 visibility(Surface s)
{
    vec2 q = light_project(s.p), texel = sat_texel(), least = P(min_filter) * texel;
    vec2 widest = 0.5 * sat_info.window * texel;
    ReceiverPlane plane = receiver_plane(s.p, s.n);
    float bias = surface_bias(s, P(bias)) / (light.far_z - light.near_z);
    // The square as large as the disk.
    float shape = light.shape == SHAPE_DISK ? 0.88622693 : 1.0;
    float nearest_z;
    vec2 extent = min_max_search_extent(q, s.p.z, least, nearest_z);
    bool lit, blocked;
    classify_window(q, extent, plane, bias, lit, blocked);
    float v = lit ? 1.0 : 0.0;
    int steps = lit || blocked ? 0 : 2;
    for (int i = 0; i < steps; i++) {
        extent = min(max(extent * shape, least), widest);
        vec2 low = clamp((q - extent - light.rect.xy) / texel, 0.0, sat_info.side);
        vec2 high = clamp((q + extent - light.rect.xy) / texel, 0.0, sat_info.side);
        vec2 size = high - low;
        // What lies outside the map is lit.
        float inside = size.x * size.y * texel.x * texel.y / (4.0 * extent.x * extent.y);
        int parts = min(size.x, size.y) < 2.0 * float(P(parts)) ? 1 : int(P(parts));
        parts = min(size.x, size.y) > 1e-3 ? parts : 0;
        vec2 step = size / float(max(parts, 1)), sum = vec2(0.0);
        for (int k = 0; k < parts * parts; k++) {
            vec2 from = low + vec2(k % parts, k / parts) * step;
            sum += part_blockers(from, min(from + step, high), i > 0, q, plane, bias);
        }
        float shadow = sum.x / float(max(parts * parts, 1));
        if (i == 0) {
            float z = depth_unit_to_z(0.5 + 0.5 * sum.y / max(sum.x, 1e-6));
            z = clamp(z, min(nearest_z, s.p.z), s.p.z);
            extent = light_filter_extent(z, s.p.z);
            if (shadow > 0.99) {
                shadow = 1.0;
                steps = 1;
            }
        }
        // Rounding leaves shares of up to a thousandth where nothing blocks.
        v = 1.0 - inside * clamp((shadow - 0.002) / 0.996, 0.0, 1.0);
    }
    return scalar_visibility(reduce_bleeding(v, P(bleed)));
}
