// Sum over the leaves' corners. Where all samples agree it is 1 or 0 without looking.
#include "sample_maps.glsl"
#include "adaptive_bits.glsl"
#include "adaptive_resolve.def"
layout(binding = UNIT_FILTERED) uniform sampler2D filtered; // of adaptive_filter.glsl

vec4 visibility(Surface s)
{
    uvec2 words[22];
    bool lit = true, dark = true;
    for (int i = 0; i < tree.count.y; i++) {
        words[i] = page_bits(s.pixel, i);
        uint used = tree.used[i >> 2][i & 3];
        lit = lit && (words[i].x & used) == used;
        dark = dark && (words[i].y & used) == used;
    }
    bool seen = (words[0].x & FLAG) != 0u; // else nothing can block
    int count = seen && !lit && !dark ? tree.count.x : 0;
    SampledReceiver r = sampled_receiver(s, 0.0);
    float all_sum = 0.0, lit_sum = 0.0;
    vec3 all_emission = vec3(0.0), lit_emission = vec3(0.0);
    for (int i = 0; i < count; i++) {
        SampleMap map = tree.samples[i];
        float w = sample_weight(r, sample_view(r, map.at.xy)) * map.layer.y;
        vec3 e = light.textured != 0 ? light_emission(map.at.zw, map.layer.z) : vec3(1.0);
        all_sum += w;
        all_emission += w * e;
#ifdef KERNEL_SINGLE
        int place = int(map.layer.w);
        float lit_share = float(words[place >> 4].x >> uint(place & 15) & 1u);
        lit_sum += w * lit_share;
        lit_emission += w * lit_share * e;
#endif
    }
    if (count == 0) {
        float v = seen && dark ? 0.0 : 1.0;
        return scalar_visibility(v);
    }
#ifndef KERNEL_SINGLE
    vec4 sum = texelFetch(filtered, s.pixel, 0);
    lit_sum = sum.a;
    lit_emission = sum.rgb;
#endif
    float v = clamp(lit_sum / max(all_sum, 1e-20), 0.0, 1.0);
    if (light.textured == 0)
        return scalar_visibility(v);
    vec3 seen_share = clamp(lit_emission / max(all_emission, vec3(1e-20)), 0.0, 1.0);
    return vec4(light.emission_mean.rgb * seen_share, v);
}
