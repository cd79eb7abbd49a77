// Filtered visibility of one page's samples where samples disagree: rgb = w e V, a = w V.
#include "sample_maps.glsl"
#include "adaptive_bits.glsl"
#include "adaptive_filter.def"
layout(binding = UNIT_SAMPLE_MAPS) uniform sampler2DArray maps;

vec4 visibility(Surface s)
{
    bool lit = true, dark = true;
    for (int i = 0; i < page.count.y; i++) {
        uvec2 bits = page_bits(s.pixel, i);
        uint used = page.used[i >> 2][i & 3];
        lit = lit && (bits.x & used) == used;
        dark = dark && (bits.y & used) == used;
    }
    bool seen = (page_bits(s.pixel, 0).x & FLAG) != 0u;
    int count = seen && !lit && !dark ? page.count.x : 0;
    SampledReceiver r = sampled_receiver(s, P(bias));
    vec2 size = vec2(textureSize(maps, 0).xy);
    vec4 sum = vec4(0.0);
    for (int i = 0; i < count; i++) {
        SampleMap map = page.samples[i];
        SampleView v = sample_view(r, map.at.xy);
        float lit_share = sample_lit_box(maps, size, map, r, v, int(P(kernel)));
        float w = sample_weight(r, v) * map.layer.y * lit_share;
        vec3 e = light.textured != 0 ? light_emission(map.at.zw, map.layer.z) : vec3(1.0);
        sum += w * vec4(e, 1.0);
    }
    return sum;
}
