// The plane of the surface under a pixel, and how far neighbours are from it. Needs P(depth_sigma).
#include "view.glsl"
#include "octahedral.glsl"
layout(binding = UNIT_DEPTH) uniform sampler2D g_depth;
layout(binding = UNIT_NORMAL) uniform sampler2D g_normal;

struct Plane {
    vec3 normal;
    float depth;
    vec2 gradient; // of reversed depth, per pixel
};

Plane plane_at(ivec2 pixel)
{
    Plane plane;
    plane.depth = texelFetch(g_depth, pixel, 0).r;
    plane.normal = octahedral_decode(texelFetch(g_normal, pixel, 0).xy);
    vec3 world = unproject(view.clip_to_world, pixel_to_ndc(pixel), plane.depth);
    // Reversed infinite depth is linear over the screen on a plane.
    vec4 h = vec4(plane.normal, -dot(plane.normal, world)) * view.clip_to_world;
    vec2 most = vec2(0.2 * plane.depth);
    plane.gradient = clamp(
        -h.xy * vec2(2.0, -2.0) * view.viewport.zw / (abs(h.z) > 1e-20 ? h.z : 1e-20), -most, most);
    return plane;
}

// Of the pixel at `at` from the plane, in units of the tolerance.
float plane_distance(Plane plane, ivec2 at, ivec2 offset)
{
    float depth = texelFetch(g_depth, at, 0).r;
    return (depth - plane.depth - dot(plane.gradient, vec2(offset))) /
           (P(depth_sigma) * plane.depth);
}
