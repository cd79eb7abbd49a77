// Smooth edges out of one shaded sample per pixel. Of several places in every pixel the depth is
// known; each takes its light from those of the 3 x 3 pixels around whose planes pass through it.
// RESOLVED: the picture holds display values, else sums; RAW: a file of radiance is wanted. Else it
// is light as the display gives it off that is averaged: what is too bright for it has no stairs.
// ALONE: only what the file holds of each pixel without its neighbours.
// LAYERED: blended surfaces lie in front of some pixels, and a plane has to explain what is solid
// while the plane of the first of them explains what is nearest.
#include "view.glsl"
#include "octahedral.glsl"
#include "display.glsl"
#include "edges.def"

layout(binding = UNIT_DEPTH) uniform sampler2D g_depth;
layout(binding = UNIT_NORMAL) uniform sampler2D g_normal;
layout(binding = UNIT_TILES) uniform sampler2D tile_classes;    // of edge_tiles.frag
layout(binding = UNIT_PLACES) uniform sampler2DMS place_depths; // of some rows
layout(binding = UNIT_SOURCE) uniform sampler2D picture;

#ifdef LAYERED
layout(binding = UNIT_BEFORE) uniform sampler2D front_depth; // of the first blended layer
layout(binding = UNIT_FRONT_NORMAL) uniform sampler2D front_normal;
layout(binding = UNIT_FRONT_PLACES) uniform sampler2DMS front_places;
#endif

layout(location = 0) out vec4 color;

const float MIXED = 0.3; // as much of its neighbours' light has a place that its own plane explains
const float CENTRE = 0.5; // weight of what was shaded, over that of a place

// What the file holds of a pixel, without its neighbours.
vec4 alone(vec4 c)
{
#ifdef RAW
    return vec4(c.rgb * view.display.x, c.a);
#elif defined(RESOLVED)
    return c;
#else
    return c.a > 0.0 ? vec4(display_encode(c.rgb / c.a), c.a) : vec4(0.0);
#endif
}

// Its light, times alpha.
vec4 light_of(vec4 c)
{
    c = alone(c);
#ifdef RAW
    return c;
#else
    return vec4(srgb_decode(c.rgb) * c.a, c.a);
#endif
}

// Reversed depth is linear in the picture along a plane: its value at the pixel's centre, and its
// gradient per pixel. The normal's length cancels out.
vec3 plane_of(float depth, vec2 normal, ivec2 pixel, vec3 right, vec3 up)
{
    vec3 n = octahedral_direction(normal);
    vec2 centred = vec2(pixel) + 0.5 - 0.5 * view.viewport.xy;
    vec2 slope = vec2(dot(n, right), -dot(n, up)) / view.eye.w;
    return vec3(
        depth, slope * (depth / min(dot(n, view.forward.xyz) + dot(slope, centred), -1e-4)));
}

float depth_at(ivec2 pixel)
{
    return texelFetch(g_depth, pixel, 0).r;
}

vec4 depths_of(sampler2DMS all, ivec2 pixel)
{
    vec4 depths;
    for (int i = 0; i < EDGE_PLACES; i++)
        depths[i] = texelFetch(all, pixel, i).r;
    return depths;
}

bool may_show_edge(ivec2 pixel)
{
    int bits = int(texelFetch(tile_classes, pixel / 4, 0).b + 0.5);
    return (bits >> (pixel.y % 4 * 4 + pixel.x % 4) & 1) != 0;
}

struct Planes {
    vec3 solid, front;
};

Planes planes_at(ivec2 pixel, vec3 right, vec3 up)
{
    Planes p;
    p.solid = plane_of(depth_at(pixel), texelFetch(g_normal, pixel, 0).xy, pixel, right, up);
    p.front = p.solid;
#ifdef LAYERED
    float depth = texelFetch(front_depth, pixel, 0).r;
    if (depth > 0.0)
        p.front = plane_of(depth, texelFetch(front_normal, pixel, 0).xy, pixel, right, up);
#endif
    return p;
}

// How well the plane of the pixel at `offset` explains the depths: 10 where it passes through them,
// falling with the distance over what the plane rises per pixel.
vec4 match(vec3 plane, vec4 depths, vec2 offset)
{
    vec4 miss = plane.x - dot(plane.yz, offset) - depths;
    miss = abs(miss + plane.y * edge.across + plane.z * edge.down);
    vec4 rise = abs(plane.y) + abs(plane.z) + 2e-3 * max(depths, plane.x) + 1e-20;
    vec4 background = mix(vec4(1e-9), vec4(10.0), equal(depths, vec4(0.0)));
    return plane.x == 0.0 ? background : rise / (miss + 0.1 * rise);
}

// Both planes of the pixel at `offset`.
vec4 match_both(Planes planes, vec4 solid, vec4 front, vec2 offset)
{
    vec4 how = match(planes.solid, solid, offset);
#ifdef LAYERED
    how = min(how, match(planes.front, front, offset));
#endif
    return how;
}

// Of the places to the pixel at `offset`.
vec4 nearness(vec2 offset)
{
    vec4 across = offset.x - edge.across, down = offset.y - edge.down;
    return 1.0 / (1.0 + across * across + down * down);
}

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = ivec2(view.viewport.xy) - 1;
    if (pixel.y < edge.rows.x || pixel.y >= edge.rows.x + edge.rows.y)
        discard;
    color = alone(texelFetch(picture, pixel, 0));
#ifndef ALONE
    // Loops, since software rasterisers leave them out where no pixel needs them.
    int around = may_show_edge(pixel) ? 8 : 0;
    vec3 right = vec3(0.0), up = vec3(0.0);
    vec4 depths = vec4(0.0), front = vec4(0.0), own = vec4(0.0), open = vec4(0.0);
    for (int once = 0; once < around; once += 8) {
        right = normalize(cross(view.forward.xyz,
            vec3(view.world_to_clip[0].y, view.world_to_clip[1].y, view.world_to_clip[2].y)));
        up = cross(right, view.forward.xyz);
        ivec2 at = pixel - ivec2(0, edge.rows.x);
        depths = depths_of(place_depths, at);
#ifdef LAYERED
        front = max(depths, depths_of(front_places, at));
#endif
        // 0 where the pixel's own plane explains the place.
        own = match_both(planes_at(pixel, right, up), depths, front, vec2(0.0));
        open = 4.0 - 0.42 * own;
        around = any(greaterThan(open, vec4(0.0))) ? 8 : 0;
        open = clamp(open, MIXED, 1.0);
        own *= nearness(vec2(0.0));
    }
    vec4 sums[EDGE_PLACES], weights = own, own_light = light_of(texelFetch(picture, pixel, 0));
    for (int i = 0; i < EDGE_PLACES; i++)
        sums[i] = own[i] * own_light;
    for (int k = 0; k < around; k++) {
        int other = k < 4 ? k : k + 1; // of 3 x 3, without the middle
        ivec2 at = clamp(pixel + ivec2(other % 3, other / 3) - 1, ivec2(0), last);
        vec4 weight = open * match_both(planes_at(at, right, up), depths, front, vec2(at - pixel));
        weight *= nearness(vec2(other % 3, other / 3) - 1.0);
        weights += weight;
        vec4 light = light_of(texelFetch(picture, at, 0));
        for (int i = 0; i < EDGE_PLACES; i++)
            sums[i] += weight[i] * light;
    }
    for (int once = 0; once < around; once += 8) {
        vec4 light = CENTRE * own_light;
        for (int i = 0; i < EDGE_PLACES; i++)
            light += sums[i] / weights[i];
        light /= float(EDGE_PLACES) + CENTRE;
        color = light;
#ifndef RAW
        color.rgb = light.a > 0.0 ? srgb_encode(light.rgb / light.a) : vec3(0.0);
#endif
    }
#endif
}
