// One batch of light samples, added to the sum: rgb = w e V (r = w V for a plain light), a = w.
#include "sample_maps.glsl"
#include "multisample.def"
layout(binding = UNIT_SAMPLE_MAPS) uniform sampler2DArray maps;
#ifdef SOME
layout(binding = UNIT_SOURCE) uniform sampler2D counts; // x: samples that a pixel has
#endif

vec4 visibility(Surface s)
{
    vec2 size = vec2(textureSize(maps, 0).xy);
    SampledReceiver r = sampled_receiver(s, P(bias));
    vec4 sum = vec4(0.0);
    int count = lookup.count.x;
#ifdef SOME
    count = texelFetch(counts, s.pixel, 0).x < lookup.weight.y ? count : 0;
#endif
    for (int i = 0; i < count; i++) {
        SampleMap map = lookup.samples[i];
        SampleView v = sample_view(r, map.at.xy);
        float lit = sample_lit(maps, size, map, r, v);
        // Light below the receiver's horizon is left out of the mean: irradiance is clipped there.
        float w = sample_weight(r, v);
        if (P(weighting) == WEIGHTING_G) {
            vec3 to = vec3(map.at.xy, 0.0) - s.p;
            float d2 = dot(to, to), f = max(v.facing, 0.0);
            w = light_parallel ? f : f * s.p.z / (d2 * d2);
        }
        sum += light.textured != 0 ? vec4(light_emission(map.at.zw, 0.0) * w * lit, w)
                                   : vec4(w * lit, 0.0, 0.0, w);
    }
    return sum * lookup.weight.x;
}
