// One filtered fetch from a blurred moment map (passes/map/moments.c) and what to compare it with.
#include "depth_unit.glsl"
#include "moments.glsl"
layout(binding = UNIT_SOURCE) uniform sampler2D moment_map; // trilinear

struct MomentLookup {
    vec4 m;
    PlaneInWindow plane; // over the texels that the fetch averages
    bool outside;        // nothing in the map: lit
};

MomentLookup moment_lookup(Surface s)
{
    MomentLookup r;
    // Around the depth map lies a margin, in which nothing is, for the kernel to run out.
    float margin = float(P(blur) + 2u), size = float(textureSize(moment_map, 0).x) - 2.0 * margin;
    vec2 uv = (light_uv(light_project(s.p)) * size + margin) / (size + 2.0 * margin);
    vec2 texel = (light.rect.zw - light.rect.xy) / size;
    // The level whose texels are as large as the pixel, seen head-on: derivatives of uv jump where
    // surfaces meet.
    float pixel = view.forward.w / (s.depth * view.eye.w);
    pixel *= light.parallel != 0 ? 1.0 : light.near_z / s.p.z;
    float last = log2(size);
    float lod = clamp(log2(pixel / max(texel.x, texel.y)), 0.0, last);
    r.m = textureLod(moment_map, uv, lod);
    vec2 reach = (float(P(blur)) + 1.5 * exp2(ceil(lod))) * texel;
    float bias = surface_bias(s, P(bias)) / (light.far_z - light.near_z);
    r.plane = plane_in_window(receiver_plane(s.p, s.n), vec2(0.0), reach, bias);
    r.outside = any(lessThan(uv, vec2(0.0))) || any(greaterThan(uv, vec2(1.0)));
    return r;
}
