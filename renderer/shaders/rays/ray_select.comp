// Lists the receivers that get all samples and settles the others. EVERY: all of them are listed.
#include "rays.def"
layout(local_size_x = RAY_TILE, local_size_y = RAY_TILE) in;
#include "ray_job.glsl"
layout(binding = UNIT_RAY_VERDICTS) uniform usampler2D verdicts;
layout(binding = UNIT_RAY_SPREAD) uniform usampler2D spread;
shared uint used, base;

bool is_receiver(ivec2 pixel)
{
    vec3 p = texelFetch(receiver_position, pixel, 0).xyz;
    float size = length(texelFetch(receiver_normal, pixel, 0).xyz), check = size + p.x + p.y + p.z;
    return size > 0.0 && !isnan(check) && !isinf(check);
}

bool wants_all(ivec2 pixel)
{
#ifdef EVERY
    return true;
#else
    bool marked = false;
    int high = min(pixel.y + DILATION, int(ray.size.y) - 1);
    for (int y = max(pixel.y - DILATION, 0); y <= high; y++)
        marked = marked || texelFetch(spread, ivec2(pixel.x, y), 0).r != 0u;
    return marked;
#endif
}

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    bool inside = all(lessThan(pixel, ivec2(ray.size.xy)));
    bool receiver = inside && is_receiver(pixel), full = receiver && wants_all(pixel), lit = false;
    if (inside && !receiver) {
        store(pixel, vec4(ray.mean.rgb, 1.0), 0.0);
    } else if (inside && !full) {
#ifndef EVERY
        bool all_seen = texelFetch(verdicts, pixel, 0).r == LIT;
#ifdef LIT_NEEDS_SUM // of emission weighted by G: samples, but no rays
        lit = all_seen;
#endif
        if (!lit)
            store(pixel, all_seen ? vec4(ray.mean.rgb, 1.0) : vec4(0.0), 0.0);
#endif
    }
    // Appended tile by tile, so that neighbours in the list are neighbours in the picture.
    if (gl_LocalInvocationIndex == 0u)
        used = 0u;
    barrier();
    uint place = full || lit ? atomicAdd(used, 1u) : 0u;
    if (full)
        atomicAdd(counters.full_pixels, 1u);
    barrier();
    if (gl_LocalInvocationIndex == 0u)
        base = atomicAdd(counters.list_count, used);
    barrier();
    if (full || lit)
        list[base + place] = uint(pixel.y) * ray.size.x + uint(pixel.x) | (lit ? LIST_LIT : 0u);
}
