// Light samples looked up in a batch of sample maps, added up as light_ratio.glsl wants it. Without
// SPARSE every pixel takes every sample; with it P(samples) of them, others than its neighbours.
// EMITTED: the denominator of a textured light.
#ifdef SPARSE
#include "dither.glsl"
#endif
#include "light_samples.def"
layout(binding = UNIT_SAMPLE_MAPS) uniform sampler2DArray maps;
layout(binding = UNIT_SPREAD) uniform sampler2D spread_map; // see penumbra_estimate.glsl

// How much sample i counts, and whether the receiver sees it.
vec2 look_up(Surface s, int i, float depth, float bias)
{
    vec2 at = batch.samples[i].at.xy, l;
    float range = light.far_z - light.near_z, facing, least, slope;
    if (light.parallel != 0) {
        l = s.p.xy + at * s.p.z;
        facing = dot(s.n.xy, at) - s.n.z;
        least = 0.02;
        slope = 1.0 / (max(facing, least) * range);
    } else {
        l = at + (s.p.xy - at) * (light.near_z / s.p.z);
        facing = dot(s.n.xy, at) - dot(s.n, s.p);
        least = 0.02 * length(s.p);
        slope = light.far_z / (range * max(facing, least));
    }
    // The receiver's plane at the texel's centre (F6, the origin moved to the sample).
    vec4 window = batch.samples[i].window;
    vec2 size = vec2(textureSize(maps, 0).xy), uv = l * window.xy + window.zw, texel = uv * size;
    vec2 offset = (floor(texel) + 0.5 - texel) / (size * window.xy);
    float plane = min(depth + slope * dot(s.n.xy, offset), 1.0) - bias;
    // As sample_weight in sample_maps.glsl.
    float w = facing > least ? 1.0 : facing > 0.0 ? 1e-3 : 0.0;
#ifdef EMITTED
    return vec2(w, w);
#else
    return vec2(w, plane <= texture(maps, vec3(uv, float(i))).r ? w : 0.0);
#endif
}

vec4 visibility(Surface s)
{
    vec2 spread = texelFetch(spread_map, s.pixel, 0).xw;
    if (spread == vec2(1.0, 0.0)) // proved to be lit, as the target starts
        discard;
    float depth = light_depth(s.p.z), bias = surface_bias(s, P(bias)) * light_depth_slope(s.p.z);
#ifdef SPARSE
    // The maps in order of x fall into as many strata as a pixel takes samples. Pixels of a 4 x 4
    // block divide each stratum among themselves; from stratum to stratum a pixel moves on, since
    // the maps' y repeats in each.
    float stratum = float(batch.range.z) / float(P(samples)),
          phase = dither(s.pixel, view.display.z);
    int first = int(float(batch.range.y) / stratum);
    int end = min(int(ceil(float(batch.range.y + batch.range.x) / stratum)), int(P(samples)));
#else
    int first = 0, end = batch.range.x;
#endif
    vec4 sum = vec4(0.0);
    for (int k = first; k < end; k++) {
#ifdef SPARSE
        int number =
            min(int((float(k) + fract(phase + float(k) / stratum)) * stratum), batch.range.z - 1);
        int i = number - batch.range.y;
        if (i < 0 || i >= batch.range.x)
            continue;
#else
        int i = k;
#endif
        vec2 seen = look_up(s, i, depth, bias);
        sum += light.textured != 0
                   ? vec4(light_emission(batch.samples[i].at.zw, batch.cell.x), 1.0) * seen.y
                   : vec4(seen.yx, 0.0, 0.0);
    }
    return sum * batch.cell.y;
}
