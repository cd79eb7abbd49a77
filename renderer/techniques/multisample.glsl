// One batch of light samples, added to the sum: rgb = w e V (r = w V for a plain light), a = w.
layout(binding = 7) uniform sampler2DArray maps;
struct SampleMap {
    vec4 at;     // xy emitter position, zw the same in [-1, 1]^2
    vec4 window; // uv = l * xy + zw
    vec4 emission;
};
layout(std140, binding = 3) uniform LookupBlock {
    SampleMap samples[16];
    ivec4 count;
    vec4 weight;
} lookup;

vec4 visibility(Surface s)
{
    vec2 size = vec2(textureSize(maps, 0).xy);
    float range = light.far_z - light.near_z, ratio = light.near_z / s.p.z;
    float depth = light_depth(s.p.z), bias = P(bias) * s.p.z * light_depth_slope(s.p.z);
    float least = 0.02 * length(s.p), np = dot(s.n, s.p);
    vec4 sum = vec4(0.0);
    for (int i = 0; i < lookup.count.x; i++) {
        vec2 at = lookup.samples[i].at.xy;
        // Where this sample's map shows the receiver, and its plane's depth gradient there (F6 with
        // the origin moved to the sample).
        vec2 l;
        float facing, slope;
        if (light_parallel) {
            l = s.p.xy + at * s.p.z;
            facing = -(s.n.z - dot(s.n.xy, at));
            slope = 1.0 / (max(facing, 0.02) * range);
        } else {
            l = at + (s.p.xy - at) * ratio;
            facing = dot(s.n.xy, at) - np;
            slope = light.far_z / (range * max(facing, least));
        }
        vec4 window = lookup.samples[i].window;
        vec2 uv = l * window.xy + window.zw;
        vec2 texel = uv * size, center = floor(texel) + 0.5;
        vec2 offset = (center - texel) / (size * window.xy);
        float plane = min(depth + slope * dot(s.n.xy, offset), 1.0) - bias;
        float lit = plane <= texture(maps, vec3(uv, float(i))).r ? 1.0 : 0.0;
        // Light below the receiver's horizon is left out of the mean: irradiance is clipped there.
#if P_weighting == 1
        vec3 to = vec3(at, 0.0) - s.p;
        float d2 = dot(to, to);
        float w = light_parallel ? max(facing, 0.0) : max(facing, 0.0) * s.p.z / (d2 * d2);
#else
        float w = facing > 0.0 ? 1.0 : 0.0;
#endif
        sum += light.textured != 0
            ? vec4(light_emission(lookup.samples[i].at.zw, 0.0) * w * lit, w)
            : vec4(w * lit, 0.0, 0.0, w);
    }
    return sum * lookup.weight.x;
}
