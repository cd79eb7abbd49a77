// Some samples for some of the listed receivers; sums are kept between calls. COLOUR sums emission,
// WEIGHTS weights by G; as renderer/trace/embree/visibility.c does.
#include "ray_trace.glsl"
#include "ray_samples.def"
layout(local_size_x = RAY_GROUP) in;
layout(binding = UNIT_EMISSION) uniform sampler2D emission_texture;

// First entry of the list, entries, first point, points.
layout(location = LOCATION_RANGE) uniform uvec4 range;
// enum ray_end: what becomes of a receiver after this.
layout(location = LOCATION_ENDS) uniform uint ends;
// Where the sums of the first entry are.
layout(location = LOCATION_STATE) uniform uint first_state;

void finish(ivec2 pixel, inout RaySums sums)
{
    uint samples = range.z + range.w;
    bool all_seen = sums.count == samples;
#ifdef WEIGHTS
    float weight = sums.weight;
#else
    float weight = float(samples);
#endif
    float error = samples > 1u && weight > 0.0 ? sqrt(sums.pairs) / weight : 0.0;
    if (ends == RAY_MAY_END && !(error < ray.bias.y))
        return;
    if (ends != RAY_IS_SEEN)
        sums.pairs = -1.0;
    vec4 v = vec4(0.0);
    if (weight > 0.0) {
        v.a = all_seen ? 1.0 : sums.visible / weight;
#ifdef COLOUR
        v.rgb = sums.rgb.rgb / weight;
#else
        v.rgb = vec3(v.a);
#endif
#ifndef WEIGHTS // nothing hidden: no noise from the emission either
        if (all_seen)
            v.rgb = ray.mean.rgb;
#endif
    }
    store(pixel, v, error);
}

void take_samples(RayReceiver r, bool traced, inout RaySums sums)
{
    float last_weight = 0.0, last_share = 0.0;
    uint rays = 0u, taken = 0u;
    for (uint i = range.z; i < range.z + range.w; i++) {
        vec2 s = light_point(points[i] ^ r.shift);
        vec3 direction = direction_to(r, s);
        float cosine = cosine_to(r, s), weight = 1.0;
        bool faced = r.reachable && cosine > 0.0;
        float share = faced ? 1.0 : 0.0;
#ifdef WEIGHTS
        float d2 = dot(direction, direction);
        weight = faced ? cosine * r.front / (d2 * d2) : 0.0;
        sums.weight += weight;
#endif
        if (faced && traced) {
            rays++;
            share = share_seen(r, direction);
        }
        sums.count += share == 1.0 ? 1u : 0u;
        sums.visible += share * weight;
#ifdef COLOUR
        if (share > 0.0)
            sums.rgb.rgb += share * weight * textureLod(emission_texture, 0.5 * s + 0.5, 0.0).rgb;
#endif
        if ((i & 1u) == 0u) {
            last_share = share;
            last_weight = weight;
        } else {
            float mean = 0.5 * (weight + last_weight) * (share - last_share);
            sums.pairs += mean * mean;
        }
        taken++;
    }
    if (bvh_cut || taken < range.w)
        counters.cut = 1u;
    count_rays(rays);
}

void main()
{
    if (gl_GlobalInvocationID.x >= range.y)
        return;
    uint entry = list[range.x + gl_GlobalInvocationID.x], number = entry & ~LIST_LIT;
    ivec2 pixel = ivec2(number % ray.size.x, number / ray.size.x);
    uint place = first_state + gl_GlobalInvocationID.x;
    RaySums sums = RaySums(0u, 0.0, 0.0, 0.0, vec4(0.0));
    if (range.z != 0u)
        sums = state[place];
    RayReceiver r;
    if (sums.pairs < 0.0 || !load_receiver(pixel, ray.net, r))
        return;
    take_samples(r, (entry & LIST_LIT) == 0u, sums);
    if (ends != RAY_GOES_ON)
        finish(pixel, sums);
    state[place] = sums;
}
