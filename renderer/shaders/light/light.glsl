// Light space: origin in the centre of the emitter, +z along the emission, the shadow map is the
// window `rect` of the plane z = near_z. A parallel light is the limit of an emitter infinitely far
// away: `extent` is then the tangent of half its diameter. docs/light-space.md derives F1 to F6.
#include "light.def"

// What never changes within a pass is a constant of the program where the pass defines it: software
// rasterisers run both sides of every branch.
#ifdef LIGHT_SHAPE
const int light_shape = LIGHT_SHAPE;
const bool light_parallel = LIGHT_PARALLEL != 0;
#else
#define light_shape light.shape
#define light_parallel (light.parallel != 0)
#endif

layout(binding = UNIT_EMISSION) uniform sampler2D emission_texture; // of the light, with mips
layout(binding = UNIT_SHADOW) uniform sampler2D shadow_map;         // hardware depth, border 1

// F1: where the map shows light-space point p, metres on the map plane.
vec2 light_project(vec3 p)
{
    return light_parallel ? p.xy : p.xy * (light.near_z / p.z);
}

vec2 light_uv(vec2 l)
{
    return (l - light.rect.xy) / (light.rect.zw - light.rect.xy);
}

vec2 light_texel(sampler2D map) // m per texel on the map plane
{
    return (light.rect.zw - light.rect.xy) / vec2(textureSize(map, 0));
}

// Hardware depth (0 at near_z, 1 at far_z) and back.
float light_depth(float z)
{
    float t = (z - light.near_z) / (light.far_z - light.near_z);
    return light_parallel ? t : t * light.far_z / z;
}

float light_linear(float d)
{
    return light_parallel
               ? mix(light.near_z, light.far_z, d)
               : light.near_z * light.far_z / (light.far_z - d * (light.far_z - light.near_z));
}

// Change of hardware depth per metre along z, at z.
float light_depth_slope(float z)
{
    float range = light.far_z - light.near_z;
    return light_parallel ? 1.0 / range : light.near_z * light.far_z / (range * z * z);
}

// F2: W(c_z); the light point hidden by map position l is (l - q) / W.
float light_window_scale(float caster_z, float receiver_z)
{
    return light_parallel ? receiver_z - caster_z
                          : light.near_z * (receiver_z - caster_z) / (receiver_z * caster_z);
}

// F3, F4: half extents on the map plane of the filter region and of the blocker search.
vec2 light_filter_extent(float caster_z, float receiver_z)
{
    return light.extent * light_window_scale(caster_z, receiver_z);
}

vec2 light_search_extent(float receiver_z)
{
    float z = max(receiver_z - light.near_z, 0.0);
    return light.extent * (light_parallel ? z : z / receiver_z);
}

// F6, the receiver's own plane in the map: hardware depth is linear over the map plane, so the
// depth of the plane at l is depth + dot(gradient, l - q).
struct ReceiverPlane {
    float depth;
    vec2 gradient;
};

ReceiverPlane receiver_plane(vec3 p, vec3 n)
{
    ReceiverPlane plane;
    float range = light.far_z - light.near_z;
    plane.depth = light_depth(p.z);
    // At grazing incidence the plane runs through the light: bounded to about 1 degree. A receiver
    // that turns its back to the light's centre is not in the map at all: its plane says nothing of
    // what is, so its own depth is compared.
    if (light_parallel) {
        plane.gradient = n.z < 0.0 ? -n.xy / (min(n.z, -0.02) * range) : vec2(0.0);
    } else {
        float np = dot(n, p);
        plane.gradient =
            np < 0.0 ? -light.far_z / range * n.xy / min(np, -0.02 * length(p)) : vec2(0.0);
    }
    return plane;
}

// Depth against which a texel at l is compared: on the plane, at most the border's.
float plane_depth(ReceiverPlane plane, vec2 offset, float bias)
{
    return min(plane.depth + dot(plane.gradient, offset), 1.0) - bias;
}

// True when some point of the emitter lies above the receiver's horizon.
float light_reach_along(vec3 n) // from the centre to the point that is farthest along n
{
    vec2 across = abs(n.xy) * light.extent;
    return light_shape == SHAPE_DISK ? light.extent.x * length(n.xy) : across.x + across.y;
}

bool light_is_above_horizon(vec3 p, vec3 n)
{
    return (light_parallel ? -n.z : -dot(n, p)) + light_reach_along(n) > 0.0;
}

bool light_is_wholly_above_horizon(vec3 p, vec3 n)
{
    return (light_parallel ? -n.z : -dot(n, p)) - light_reach_along(n) > 0.0;
}

// Emission at emitter position s in [-1, 1]^2, averaged over a square of `size` (2: all of it). The
// texture is stored in the light's own axes, row 0 at y = -1.
vec3 light_emission(vec2 s, float size)
{
    if (light.textured == 0)
        return vec3(1.0);
    float texels = 0.5 * size * float(textureSize(emission_texture, 0).x);
    return textureLod(emission_texture, 0.5 * s + 0.5, log2(max(texels, 1.0))).rgb;
}

// Visibility of a method that has only a mean: the light's mean colour times it.
vec4 scalar_visibility(float v)
{
    return vec4(light.emission_mean.rgb * v, v);
}
