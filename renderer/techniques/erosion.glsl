// Klein et al. 2014, variant pcf: the penumbra grows from the edges of the hard shadow by their own
// width, found in the edge pyramid, and percentage-closer filtering runs only there.
#include "light_pcf.glsl"
#include "dither.glsl"
#include "erosion_window.glsl"
#include "erosion.def"
layout(binding = UNIT_HARD) uniform sampler2D hard_map;
layout(binding = UNIT_EDGES) uniform sampler2D edge_pyramid; // trilinear

// The largest W of the edges within `radius` pixels, from 2 x 2 texels; 0: none.
float edge_within(ivec2 pixel, float radius)
{
    int level = min(int(ceil(log2(2.0 * radius))), textureQueryLevels(edge_pyramid) - 1);
    ivec2 last = max(ivec2(view.viewport.xy) >> level, ivec2(1)) - 1, r = ivec2(ceil(radius));
    ivec2 a = clamp((pixel - r) >> level, ivec2(0), last);
    ivec2 b = clamp((pixel + r) >> level, ivec2(0), last);
    return max(max(texelFetch(edge_pyramid, a, level).x, texelFetch(edge_pyramid, b, level).x),
        max(texelFetch(edge_pyramid, ivec2(b.x, a.y), level).x,
            texelFetch(edge_pyramid, ivec2(a.x, b.y), level).x));
}

// Mean W of the edges around, by a tent of 3 x 3 filtered taps: the pyramid's maxima would show
// their blocks.
float edge_mean(ivec2 pixel, float radius)
{
    float lod = max(log2(radius) - 0.6, 0.0);
    vec2 sum = vec2(1e-12, 0.0);
    for (int i = 0; i < 9; i++) {
        vec2 at = vec2(i % 3, i / 3) - 1.0, tent = 1.0 - 0.5 * abs(at);
        vec2 uv = (vec2(pixel) + 0.5 + 0.67 * radius * at) * view.viewport.zw;
        sum += tent.x * tent.y * textureLod(edge_pyramid, uv, lod).yz;
    }
    return sum.y / sum.x;
}

vec4 visibility(Surface s)
{
    vec4 hard = texelFetch(hard_map, s.pixel, 0);
    if (hard.x == 1.0 && hard.z == 0.0)
        discard;
    // The widest penumbra this receiver can have, then that of the edges inside.
    float radius = clamp(hard.z * hard.w, 1.5, float(P(max_radius)));
    float w = hard.z > 0.0 ? edge_within(s.pixel, radius) : 0.0;
    radius = clamp(w * hard.w, 1.5, radius);
    w = w > 0.0 ? edge_within(s.pixel, radius) : 0.0;
    float bias = surface_bias(s, P(bias)) * light_depth_slope(s.p.z);
    HorizonBack back = horizon_back(s.p, s.n, bias);
    // Where the light's centre sees the receiver's back there is no edge to grow from, and all that
    // may block counts.
    bool turned = back.depth > 0.0 && hard.z > 0.0;
    int count = turned || w > 0.0 ? int(P(filter_taps)) : 0;

    vec2 q = light_project(s.p), texel = light_texel(shadow_map);
    if (w > 0.0)
        w = min(edge_mean(s.pixel, radius), min(hard.z, float(P(max_radius)) / hard.w));
    w = turned ? hard.z : w;
    vec2 extent = max(window_extent * w, P(min_filter) * texel);
    ReceiverPlane plane = receiver_plane(s.p, s.n);
#ifdef INTERLEAVED
    vec2 shift = dither2(s.pixel, view.display.z);
#else
    vec2 shift = vec2(0.5);
#endif
    float filtered =
        light_pcf(s, plane, back, light_uv(q), extent, bias, count, int(P(filter_taps)), shift);
    float v = count > 0 ? filtered : max(hard.x, 0.0);
#ifdef INTERLEAVED
    return vec4(v, count > 0 ? 2.0 * w * hard.w : 0.0, 0.0, 1.0);
#else
    return scalar_visibility(v);
#endif
}
