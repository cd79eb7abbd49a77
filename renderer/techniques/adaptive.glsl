// Chun and Oh 2016: the filter window of a soft shadow maps onto the light without mirroring (F2),
// so a part of the window tells which part of the light is seen. Where visibility and emission
// vary, the window is split into quarters, at most twice: T = sum of area x visibility x emission.
#include "receiver.glsl"
#include "window.glsl"
#include "taps.glsl"
#include "interleave_colour.glsl"

#include "adaptive.def"

// Those of a cell estimator, in adaptive_csm.glsl or adaptive_pcf.glsl:
Receiver adaptive_receiver(Surface s);
int adaptive_window(Receiver r, vec2 extent);
float adaptive_blocker_depth(
    Receiver r, vec2 extent, vec2 shift, bool wanted, float nearest_z, float receiver_z);
float estimate(Receiver r, vec2 offset, vec2 extent, vec2 shift, int level);

// Means over a square of the light, centre in [-1, 1]^2: rgb emission, a of its squared channels.
vec4 emission_moments(vec2 center, int level)
{
    if (light.textured == 0)
        return vec4(1.0);
    float coarsest = float(textureQueryLevels(emission_texture) - 1);
    return textureLod(emission_texture, 0.5 * center + 0.5, coarsest - float(level));
}

// Standard deviation over mean of emission that counts as constant: half floats round to a
// thousandth of its square, and as much again is lost in its mean over a cell.
const float constant_emission = 0.04;
// Variance of a visibility that is neither 0 nor 1: 1 % of the light is hidden, or seen.
const float partly_visible = 0.0099;

// 0: a cell stays whole, 1: its quarters replace it; between them over a band of variances, so that
// no seam shows. A cell is split where visibility varies much, or where emission does and
// visibility is not the same everywhere; never where emission is constant (section 3.1).
float split_weight(float visible, vec4 emission)
{
    if (P(mode) != MODE_ADAPTIVE)
        return P(mode) == MODE_FIXED2 ? 1.0 : 0.0;
    if (P(theta) < 0.0)
        return 1.0;
    float mean = dot(emission.rgb, emission.rgb) / 3.0;
    float spread = max(emission.a - mean, 0.0), colour = P(colour), least = P(theta);
    float constant = min(colour, constant_emission);
    if (spread < constant * constant * mean)
        return 0.0;
    if (colour > 0.0 && spread >= colour * colour * mean)
        least = min(least, partly_visible);
    float variance = visible - visible * visible; // of a binary variable
    return clamp((variance - least) / max(P(blend), 1e-6), 0.0, 1.0);
}

vec2 quarter(int i)
{
    return vec2(i & 1, i >> 1) - 0.5;
}

// Coloured and mean visibility of one quarter of the light, itself split where it pays.
vec4 quarter_visibility(Receiver r, vec2 center, vec2 extent, vec2 shift, inout uint depth)
{
    float visible = estimate(r, center * extent, 0.5 * extent, shift, 1);
    vec4 emission = emission_moments(center, 1);
    vec4 whole = vec4(emission.rgb * visible, visible);
    float weight = split_weight(visible, emission);
    if (weight <= 0.0)
        return whole;
    depth = 2u;
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 4; i++) {
        vec2 at = center + 0.5 * quarter(i);
        float v = estimate(r, at * extent, 0.25 * extent, shift, 2);
        sum += vec4(emission_moments(at, 2).rgb * v, v);
    }
    return mix(whole, 0.25 * sum, weight);
}

vec4 visibility(Surface s)
{
    Receiver r = adaptive_receiver(s);
#ifdef INTERLEAVED
    vec2 shift = frame_shift(s.pixel);
#else
    vec2 shift = vec2(0.5);
#endif
    float nearest_z;
    vec2 extent = min_max_search_extent(r.q, s.p.z, r.metres, nearest_z);
    int kind = adaptive_window(r, extent);
    float caster_z =
        adaptive_blocker_depth(r, extent, shift, kind == WINDOW_MIXED, nearest_z, s.p.z);
    extent = max(light_filter_extent(caster_z, s.p.z), P(min_filter) * r.metres);
    if (kind == WINDOW_MIXED)
        kind = adaptive_window(r, 1.5 * extent);
    uint depth = 0u;
    vec4 result = scalar_visibility(kind == WINDOW_BLOCKED ? 0.0 : 1.0);
    if (kind == WINDOW_MIXED) {
        float visible = estimate(r, vec2(0.0), extent, shift, 0);
        result = scalar_visibility(visible);
        // Quarters of a disk are no squares; only rectangles are textured.
        float weight =
            light.shape == SHAPE_DISK ? 0.0 : split_weight(visible, emission_moments(vec2(0.0), 0));
        if (weight > 0.0) {
            depth = 1u;
            vec4 sum = vec4(0.0);
            for (int i = 0; i < 4; i++)
                sum += quarter_visibility(r, quarter(i), extent, shift, depth);
            result = mix(result, 0.25 * sum, weight);
        }
    }
    if (depth > 0u)
        atomicAdd(subdivided[depth - 1u], 1u);
#ifdef INTERLEAVED
    // F5, for the averaging pass.
    float scale = light.parallel != 0 ? 1.0 : s.p.z / light.near_z;
    float pixels = 2.0 * min(extent.x, extent.y) * scale * view.eye.w * s.depth / view.forward.w;
    return interleave_colour(result, kind == WINDOW_MIXED ? pixels : 0.0);
#else
    return result;
#endif
}
