// Light samples looked up in a batch of sample maps, added up as light_ratio.glsl wants it. Without
// SPARSE every pixel takes every sample; with it P(samples) of them, others than its neighbours.
// EMITTED: the denominator of a textured light.
#ifdef SPARSE
#include "taps.glsl"
#endif
layout(binding = 7) uniform sampler2DArray maps;
struct SampleMap {
    vec4 at;     // xy emitter position, zw the same in [-1, 1]^2
    vec4 window; // uv = l * xy + zw
    vec4 emission;
};
layout(std140, binding = 3) uniform SampleBlock {
    SampleMap samples[16];
    ivec4 range; // samples of this batch, number of the first, samples in all
    vec4 cell;   // x: side of the emitter's part that a sample stands for, in [-1, 1]
} batch;

// How much sample i counts, and whether the receiver sees it.
vec2 look_up(Surface s, int i, float depth, float bias)
{
    vec2 at = batch.samples[i].at.xy, l;
    float range = light.far_z - light.near_z, facing, slope;
    if (light.parallel != 0) {
        l = s.p.xy + at * s.p.z;
        facing = dot(s.n.xy, at) - s.n.z;
        slope = 1.0 / (max(facing, 0.02) * range);
    } else {
        l = at + (s.p.xy - at) * (light.near_z / s.p.z);
        facing = dot(s.n.xy, at) - dot(s.n, s.p);
        slope = light.far_z / (range * max(facing, 0.02 * length(s.p)));
    }
    // The receiver's plane at the texel's centre (F6, the origin moved to the sample).
    vec4 window = batch.samples[i].window;
    vec2 size = vec2(textureSize(maps, 0).xy), uv = l * window.xy + window.zw, texel = uv * size;
    vec2 offset = (floor(texel) + 0.5 - texel) / (size * window.xy);
    float plane = min(depth + slope * dot(s.n.xy, offset), 1.0) - bias;
    // Light below the receiver's horizon is left out of the mean: irradiance is clipped there.
    float w = facing > 0.0 ? 1.0 : 0.0;
#ifdef EMITTED
    return vec2(w, w);
#else
    return vec2(w, plane <= texture(maps, vec3(uv, float(i))).r ? w : 0.0);
#endif
}

vec4 visibility(Surface s)
{
    float depth = light_depth(s.p.z), bias = P(bias) * s.p.z * light_depth_slope(s.p.z);
#ifdef SPARSE
    // Pixels of a 4 x 4 block divide each stratum among themselves.
    float stratum = float(batch.range.z) / float(P(samples));
    float shift = frame_shift(s.pixel).x * stratum;
    int first = max(int(ceil((float(batch.range.y) - shift) / stratum)), 0);
    int end = min(int(ceil((float(batch.range.y + batch.range.x) - shift) / stratum)),
        int(P(samples)));
#else
    int first = 0, end = batch.range.x;
#endif
    vec4 sum = vec4(0.0);
    for (int k = first; k < end; k++) {
#ifdef SPARSE
        int i = clamp(int(float(k) * stratum + shift) - batch.range.y, 0, batch.range.x - 1);
#else
        int i = k;
#endif
        vec2 seen = look_up(s, i, depth, bias);
        sum += light.textured != 0
            ? vec4(light_emission(batch.samples[i].at.zw, batch.cell.x), 1.0) * seen.y
            : vec4(seen.yx, 0.0, 0.0);
    }
    return sum;
}
