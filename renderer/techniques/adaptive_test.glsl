// Tests the new samples of one page. The result is added to the page's bits.
#include "sample_maps.glsl"
#include "min_max.glsl"
#include "adaptive_bits.glsl"
#include "adaptive_test.def"
layout(binding = UNIT_SAMPLE_MAPS) uniform sampler2DArray maps;

vec4 visibility(Surface s)
{
    SampledReceiver r = sampled_receiver(s, P(bias));
    vec2 size = vec2(textureSize(maps, 0).xy);
    vec2 texel = (light.rect.zw - light.rect.xy) / vec2(2 * textureSize(min_max_pyramid, 0));
    float nearest_z;
    min_max_search_extent(light_project(s.p), s.p.z, test.reach.x * texel, nearest_z);
    bool blocked = nearest_z < s.p.z;
    uvec2 bits = uvec2(0u);
    int count = blocked ? test.count.x : 0;
    for (int i = 0; i < count; i++) {
        SampleMap map = test.samples[i];
        SampleView v = sample_view(r, map.at.xy);
        float lit = sample_lit_box(maps, size, map, r, v, int(P(kernel)));
        uint bit = v.facing > 0.0 ? 1u << uint(map.layer.x) : 0u;
        bits |= uvec2(lit > 0.999 ? bit : 0u, lit < 0.001 ? bit : 0u);
    }
    if (blocked && test.count.y != 0)
        bits.x |= FLAG;
    return vec4(vec2(bits) / 65535.0, 0.0, 0.0);
}
