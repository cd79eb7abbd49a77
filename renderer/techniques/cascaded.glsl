// One cascade: darkness of the receivers in its range of view distances, times its share of them
// where cascades blend. rgb = mean emission - T, a = 1 - V: what no cascade touches stays lit.
#include "sample_maps.glsl"
#include "min_max.glsl"
#include "cascaded.def"
layout(binding = UNIT_SAMPLE_MAPS) uniform sampler2DArray maps;

float ramp(float d, float from, float to)
{
    return clamp((d - from) / max(to - from, 1e-20), 0.0, 1.0);
}

// Half extents on the map plane that one sample's kernel must cover to meet its neighbours': the
// image of its part of the emitter, for the mean depth of what blocks (F3). Negative: nothing
// blocks.
vec2 kernel_extent(SampledReceiver r, vec2 size, vec2 q)
{
    float nearest_z, sum = 0.0, blockers = 0.0;
    vec2 texel = (light.rect.zw - light.rect.xy) / vec2(2 * textureSize(min_max_pyramid, 0));
    vec2 search = min_max_search_extent(q, r.p.z, texel, nearest_z) / float(cascade.count.z);
    int count = nearest_z < r.p.z ? cascade.count.x : 0;
    for (int i = 0; i < count; i++) {
        SampleMap map = cascade.samples[i];
        SampleView v = sample_view(r, map.at.xy);
        for (int k = 0; k < (map.layer.x < 0.0 ? 0 : 4); k++) {
            vec2 offset = (vec2(k & 1, k >> 1) - 0.5) * search;
            vec2 d = sample_depths(maps, size, map, r, v, offset);
            if (d.x < d.y) {
                sum += light_linear(d.x);
                blockers += 1.0;
            }
        }
    }
    if (blockers == 0.0)
        return vec2(-1.0);
    return light_filter_extent(min(sum / blockers, r.p.z), r.p.z) / float(cascade.count.z);
}

// kernel^2 taps over +- extent around the sample's view of the receiver, at least +- a texel. The
// samples shift their taps against each other, so that straight edges get kernel * side * side
// levels; where that is few (not MANY_LEVELS), each comparison is interpolated too.
float lit_bridged(vec2 size, SampleMap map, SampledReceiver r, SampleView v, vec2 extent, int i)
{
    int kernel = cascade.count.y, side = cascade.count.z;
    vec2 spacing = 2.0 / float(kernel) * max(extent, 1.0 / (size * map.window.xy));
    vec2 shift = (vec2(i / side, i % side) + 0.5) / float(side) - 0.5 * float(kernel);
    float sum = 0.0;
    for (int y = 0; y < kernel; y++)
        for (int x = 0; x < kernel; x++) {
            vec2 offset = (shift + vec2(x, y)) * spacing;
#ifdef MANY_LEVELS
            vec2 d = sample_depths(maps, size, map, r, v, offset);
            sum += d.y <= d.x ? 1.0 : 0.0;
#else
            sum += sample_lit_bilinear(maps, size, map, r, v, offset);
#endif
        }
    return sum / float(kernel * kernel);
}

vec4 visibility(Surface s)
{
    float view_z = view.forward.w / s.depth;
    float share = ramp(view_z, cascade.fade.x, cascade.fade.y) *
                  (1.0 - ramp(view_z, cascade.fade.z, cascade.fade.w));
    if (share <= 0.0)
        discard;
    vec2 size = vec2(textureSize(maps, 0).xy), q = light_project(s.p), extent = vec2(0.0);
    SampledReceiver r = sampled_receiver(s, P(bias));
    int count = cascade.count.x;
#ifndef KERNEL_SINGLE
    if (P(filter) == FILTER_BRIDGE) {
        extent = kernel_extent(r, size, q);
        count = extent.x < 0.0 ? 0 : count; // a dynamic bound skips the loop, a return would not
    }
#endif
    // Light below the receiver's horizon is left out of the mean.
    float all_sum = 0.0, lit_sum = 0.0;
    vec3 all_emission = vec3(0.0), lit_emission = vec3(0.0);
    for (int i = 0; i < count; i++) {
        SampleMap map = cascade.samples[i];
        SampleView v = sample_view(r, map.at.xy);
        float w = sample_weight(r, v) * map.layer.y, lit = 1.0;
        if (map.layer.x >= 0.0) {
#ifndef KERNEL_SINGLE
            if (P(filter) == FILTER_BRIDGE)
                lit = lit_bridged(size, map, r, v, extent, i);
            else
#endif
                lit = sample_lit_box(maps, size, map, r, v, cascade.count.y);
        }
        all_sum += w;
        lit_sum += w * lit;
        if (light.textured != 0) {
            vec3 e = light_emission(map.at.zw, map.layer.z);
            all_emission += w * e;
            lit_emission += w * lit * e;
        }
    }
    // What is seen of each colour, so that lit receivers see exactly the mean emission.
    float v = 1.0;
    vec3 seen = vec3(1.0);
    if (count > 0) {
        v = lit_sum / max(all_sum, 1e-20);
        seen = light.textured != 0 ? lit_emission / max(all_emission, vec3(1e-20)) : vec3(v);
    }
    return share * vec4(light.emission_mean.rgb * (1.0 - seen), 1.0 - v);
}
