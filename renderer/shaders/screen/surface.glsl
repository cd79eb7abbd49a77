// The receiver under a pixel, in light space (docs/light-space.md).
#include "view.glsl"
#include "octahedral.glsl"
#include "light.glsl"

layout(binding = UNIT_DEPTH) uniform sampler2D g_depth;
layout(binding = UNIT_NORMAL) uniform sampler2D g_normal;

struct Surface {
    vec3 p;      // m, light space
    vec3 n;      // unit geometric normal, light space, towards the viewer
    float depth; // hardware depth of the camera, reversed
    ivec2 pixel;
};

Surface surface_at(ivec2 pixel, float depth)
{
    Surface s;
    s.pixel = pixel;
    s.depth = depth;
    s.p = unproject(light.clip_to_light, pixel_to_ndc(pixel), depth);
    s.n = mat3(light.world_to_light) * octahedral_decode(texelFetch(g_normal, pixel, 0).xy);
    return s;
}

// What coordinates of that size are rounded to on their way into a map and out of a picture, m; a
// map's depths keep the less of them, the nearer the light.
float surface_rounding(Surface s)
{
    vec3 eye = abs(view.eye.xyz);
    float size = max(max(eye.x, eye.y), eye.z) + view.forward.w / s.depth;
    return 2.5e-7 * size * (light_parallel ? 1.0 : clamp(s.p.z / light.near_z, 1.0, 8.0));
}

// By how much it may lie behind its own depth in a map, m.
float surface_bias(Surface s, float share)
{
    return share > 0.0 ? max(share * s.p.z, surface_rounding(s)) : 0.0;
}

vec3 surface_shading_normal(ivec2 pixel)
{
    return mat3(light.world_to_light) * octahedral_decode(texelFetch(g_normal, pixel, 0).zw);
}

// Distance of the pixel's surface along the view axis, m.
float surface_view_distance(Surface s)
{
    vec3 world = unproject(view.clip_to_world, pixel_to_ndc(s.pixel), s.depth);
    return dot(world - view.eye.xyz, view.forward.xyz);
}
