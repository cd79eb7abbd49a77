// Yang et al. 2010: both steps of percentage-closer soft shadows from mean and variance of depth in
// a window, by Chebyshev's inequality. That bound says nothing where the window's mean lies behind
// the receiver although something in it blocks: such windows are split.
#include "depth_unit.glsl"
#include "moments.glsl"
#include "sat.glsl"
#include "horizon.glsl"
#include "classify.glsl"
#include "taps.glsl"

struct Receiver {
    vec2 q;
    ReceiverPlane plane;
    HorizonBack back;
    vec2 bias; // in unit depth and in hardware depth
    vec3 p, n;
    float light; // 1 where window positions stand for points of the emitter (F2), 0 in the search
};

// Shares of a part of a window, and what they are worth in depth.
struct Share {
    float lit, blocked;
    float blocker_depth; // blocked times mean unit depth of the blockers
};

// One square of the quadtree: low, high in texels of the table. `exact`: corners count by the part
// of the texel, else whole texels do. False when it has to be split.
bool evaluate(vec2 low, vec2 high, bool exact, int level, vec2 shift, Receiver r, out Share share)
{
    vec2 texel = sat_texel();
    if (!exact) {
        low = floor(low + shift);
        high = clamp(floor(high + shift), vec2(1.0), vec2(sat_info.side));
        low = min(low, high - 1.0);
    }
    vec2 extent = 0.5 * (high - low) * texel;
    vec2 offset = 0.5 * (low + high) * texel + light.rect.xy - r.q;
    PlaneInWindow t = plane_in_window(r.plane, offset, extent + 0.5 * texel, r.bias.x);
    vec2 range = vec2(0.0, 1.0);
    bool lit = false, blocked = false;
    if (P(subdivide) != SUBDIVIDE_OFF) {
        range = min_max_window(r.q + offset, extent);
        range = vec2(depth_unit_of_z(range.x), depth_unit_of_z(range.y));
        lit = range.x >= t.highest;
        blocked = range.y < t.lowest;
    }
    // A loop, because software rasterisers skip the loads of one that does not run.
    bool planar = true, ok = true;
    share = Share(1.0, 0.0, 0.0);
    for (int i = lit ? 1 : 0; i < 1; i++) {
        vec4 m = exact ? sat_mean(low, high) : sat_mean_whole(ivec2(low), ivec2(high));
        float d = t.mean - m.x;
        planar = d <= 0.0;
        float p = planar ? 1.0 : chebyshev(m.xy, t.mean, P(min_variance));
        share = Share(p, 1.0 - p, max(m.x - p * t.mean, 0.0));
        if (blocked)
            share = Share(0.0, 1.0, m.x);
        if (P(subdivide) == SUBDIVIDE_OFF)
            break;
        // Nothing sticks out of a small part of the receiver: it is lit, however its slope spreads
        // the depths. For the whole window classify_window() has looked closer.
        if (level > 0 && range.x >= t.lowest) {
            lit = true;
            share = Share(1.0, 0.0, 0.0);
        }
        // Mean and variance place all blockers at one depth; when that is not where the nearest
        // ones are, there are no two planes here.
        float ratio =
            (m.y - 2.0 * t.mean * m.x + t.mean * t.mean) / max(d * (t.mean - range.x), 1e-12);
        bool two_planes = abs(ratio - 1.0) < P(tolerance);
        ok = lit || (r.back.depth < 0.0 && (blocked || (!planar && two_planes)));
        share.blocker_depth = clamp(
            share.blocker_depth, share.blocked * max(range.x, 0.0), share.blocked * t.highest);
    }
    return ok;
}

// The same by depth comparisons on a grid. Points of the emitter below the receiver's horizon are
// left out. `extent`: of the whole window.
Share compare(vec2 low, vec2 high, vec2 shift, vec2 extent, Receiver r)
{
    Share share = Share(0.0, 0.0, 0.0);
    vec2 texel = sat_texel(), map_texel = light_texel(shadow_map);
    // Depth within a texel differs from its centre's by half a texel along the slope.
    float bias = r.bias.y + 0.5 * dot(abs(r.plane.gradient), map_texel);
    int grid = int(P(leaf_grid));
    for (int i = 0; i < grid * grid; i++) {
        vec2 at = (vec2(i % grid, i / grid) + shift) / float(grid);
        vec2 l = (floor(mix(low, high, at) * texel / map_texel) + 0.5) * map_texel;
        l += light.rect.xy;
        vec2 offset = l - r.q;
        float d = texture(shadow_map, light_uv(l)).r;
        bool blocked = d < plane_depth(r.plane, offset, bias) && d > back_depth(r.back, offset);
        bool above = horizon_height(r.p, r.n, clamp(offset / extent, -1.0, 1.0)) > 0.0;
        float weight = r.light == 0.0 || above ? 1.0 : 0.0;
        share.lit += blocked ? 0.0 : weight;
        share.blocked += blocked ? weight : 0.0;
        share.blocker_depth += blocked ? weight * depth_unit(d) : 0.0;
    }
    float scale = 1.0 / float(grid * grid);
    return Share(share.lit * scale, share.blocked * scale, share.blocker_depth * scale);
}

int even_bits(int m) // of a Morton number
{
    return (m & 1) | (m >> 1 & 2) | (m >> 2 & 4) | (m >> 3 & 8);
}

// Walks the quadtree over q +- extent depth-first. What lies outside the map is lit.
Share window_share(vec2 extent, bool exact, vec2 shift, Receiver r)
{
    int first = P(subdivide) == SUBDIVIDE_UNIFORM ? int(P(levels)) : 0;
    int last = P(subdivide) == SUBDIVIDE_OFF ? 0 : int(P(levels));
    vec2 texel = sat_texel();
    vec2 low = clamp((r.q - extent - light.rect.xy) / texel, 0.0, sat_info.side);
    vec2 high = clamp((r.q + extent - light.rect.xy) / texel, 0.0, sat_info.side);
    vec2 size = high - low;
    float inside = size.x * size.y * texel.x * texel.y / (4.0 * extent.x * extent.y);
    Share sum = Share(1.0 - min(inside, 1.0), 0.0, 0.0);
    int level = first, m = 0, end = inside > 0.0 ? 1 << 2 * first : 0;
    while (m < end || level > first) {
        vec2 step = size * exp2(-float(level));
        vec2 a = low + vec2(even_bits(m), even_bits(m >> 1)) * step, b = min(a + step, high);
        Share share;
        bool ok = evaluate(a, b, exact && level == 0, level, shift, r, share);
        // Squares below a texel hold nothing new.
        if (!ok && level < last && min(step.x, step.y) > 1.0) {
            level++;
            m <<= 2;
            continue;
        }
        if (!ok)
            share = compare(a, b, shift, extent, r);
        float area = inside * exp2(-2.0 * float(level));
        sum.lit += area * share.lit;
        sum.blocked += area * share.blocked;
        sum.blocker_depth += area * share.blocker_depth;
        m++;
        while (level > first && (m & 3) == 0) {
            m >>= 2;
            level--;
        }
    }
    return sum;
}

vec4 visibility(Surface s)
{
    vec2 q = light_project(s.p), texel = sat_texel(), least = P(min_filter) * texel;
    vec2 widest = 0.5 * sat_info.window * texel;
    vec2 bias = surface_bias(s, P(bias)) *
                vec2(1.0 / (light.far_z - light.near_z), light_depth_slope(s.p.z));
    Receiver r =
        Receiver(q, receiver_plane(s.p, s.n), horizon_back(s.p, s.n, bias.y), bias, s.p, s.n, 0.0);
    // The square as large as the disk.
    float shape = light.shape == SHAPE_DISK ? 0.88622693 : 1.0;
    vec2 extent;
    if (P(subdivide) == SUBDIVIDE_OFF) {
        extent = max(light_search_extent(s.p.z), least);
    } else {
        float nearest_z;
        extent = min_max_search_extent(q, s.p.z, least, nearest_z);
    }
    vec2 shift = P(smooth) ? frame_shift(s.pixel) : vec2(0.5);
    float v = 1.0;
    int steps = 2;
    if (P(subdivide) != SUBDIVIDE_OFF) {
        bool lit, blocked;
        classify_window(q, extent, r.plane, bias.x, lit, blocked);
        blocked = blocked && r.back.depth < 0.0;
        v = lit ? 1.0 : 0.0;
        steps = lit || blocked ? 0 : 2;
    }
    for (int i = 0; i < steps; i++) {
        extent = min(max(extent * shape, least), widest);
        r.light = float(i);
        Share share = window_share(extent, i > 0 || P(subdivide) == SUBDIVIDE_OFF, shift, r);
        v = share.lit / max(share.lit + share.blocked, 1e-6);
        if (i == 0) {
            // Nothing blocks, or everything does: the filter would say the same.
            if (v > 0.999)
                v = 1.0;
            if (v > 0.999 || share.lit <= 0.0)
                steps = 1;
            float z = depth_unit_to_z(share.blocker_depth / max(share.blocked, 1e-6));
            extent = light_filter_extent(clamp(z, light.near_z, s.p.z), s.p.z);
        }
    }
    v = reduce_bleeding(v, P(bleed));
#ifdef INTERLEAVED
    // Width of the penumbra on the screen, F5, for the averaging pass.
    float scale = light.parallel != 0 ? 1.0 : s.p.z / light.near_z;
    float pixels = 2.0 * extent.x * scale * view.eye.w * s.depth / view.forward.w;
    return vec4(v, v < 1.0 ? pixels : 0.0, 0.0, 1.0);
#else
    return scalar_visibility(v);
#endif
}
