// The most that a method may answer, from the exact depths of the map: what lets light through
// where casters touch receivers is bias, the texels that a caster's edge does not cover, and
// filters that reach past that edge or merge depths.
//
// Contacts. Hardware depth of a plane is linear over the map (F6), so four texels of one caster
// give its plane beyond its edge too. Where it crosses the receiver's plane within reach, the two
// touch there, and the receiver sees only what of the light lies on its own side of the caster.
#ifdef WINDOWS
#include "window.glsl"
#endif
#include "horizon.glsl"
#include "bound.def"

const float UNBOUNDED = 60000.0; // of a half float

struct Contact {
    vec2 at;             // the receiver, texels
    ReceiverPlane plane; // gradient per texel
    float rounding;      // hardware depth
    float reach;         // texels
};

// The plane of a caster that touches the receiver's, the one that crosses it farthest away.
struct Caster {
    vec2 slope;     // hardware depth per texel
    float depth;    // at the receiver
    float steeper;  // than the receiver's plane, per texel
    float distance; // texels; negative: none found
};

// From the corner between four texels to their centres, in textureGather's order.
vec4 around(vec2 g)
{
    return 0.5 * vec4(g.y - g.x, g.x + g.y, g.x - g.y, -g.x - g.y);
}

void add_caster(Contact c, vec2 corner, vec4 z, inout Caster caster)
{
    vec2 g = c.plane.gradient;
    vec4 receiver = min(c.plane.depth + dot(g, corner - c.at) + around(g), 1.0);
    vec2 slope = 0.5 * vec2(z.y - z.x + z.z - z.w, z.x - z.w + z.y - z.z);
    float depth = dot(z, vec4(0.25)) + dot(slope, c.at - corner);
    float steeper = max(length(g - slope), 1e-20), distance = (c.plane.depth - depth) / steeper;
    // All four lie clearly before the receiver, and on one plane: a crease is no caster's plane.
    // The receiver's own slope is known to about a hundredth where it is steep.
    float least = c.rounding + 0.02 * length(g) + 0.1 * steeper;
    bool touches = all(lessThan(z, receiver - least)) && distance <= c.reach &&
                   abs(z.x + z.z - z.y - z.w) < c.rounding + 0.015 * steeper;
    distance = max(distance, 0.0) + (distance * steeper < -c.rounding ? -2.0 : 0.0);
    if (touches && distance > caster.distance)
        caster = Caster(slope, depth, steeper, distance);
}

// Light that the caster leaves.
float past_caster(Surface s, Contact c, Caster caster)
{
    // Its normal, towards the light, and a point of it.
    vec2 texel = light_texel(shadow_map), q = c.at * texel + light.rect.xy;
    float z = light_linear(caster.depth), range = light.far_z - light.near_z;
    vec3 p = vec3(light_parallel ? q : q * (z / light.near_z), z), n;
    n.xy = caster.slope / texel * (light_parallel ? range : range / light.far_z);
    n.z = light_parallel ? -1.0 : -(1.0 + dot(n.xy, p.xy)) / p.z;
    n = normalize(n);
    // A smooth surface curves away from its own texels' planes, and its triangles meet at such
    // angles; what stands on another meets it at a steeper one.
    if (dot(n, s.n) > 0.5 || c.plane.depth - caster.depth < -c.rounding)
        return 1.0;
    float left = 1.0 - horizon_share(p, n);
    return left < 1e-3 ? 0.0 : clamp(left / max(horizon_share(s.p, s.n), 1e-3), 0.0, 1.0);
}

vec4 visibility(Surface s)
{
    vec2 size = vec2(textureSize(shadow_map, 0)), texel = light_texel(shadow_map);
    vec2 q = light_project(s.p);
    if (light_parallel ? -s.n.z < 0.05 : -dot(s.n, s.p) < 0.05 * length(s.p))
        return vec4(UNBOUNDED); // its plane says too little of what is in the map
    ReceiverPlane plane = receiver_plane(s.p, s.n);
    Contact c;
    c.at = (q - light.rect.xy) / texel;
    c.plane = ReceiverPlane(plane.depth, plane.gradient * texel);
    c.rounding = 1e-6 + 4e-6 * s.p.z * light_depth_slope(s.p.z);
    float pixel = view.forward.w / (s.depth * view.eye.w);
    pixel *= light_parallel ? 1.0 : light.near_z / s.p.z;
    float reach = bound.reach.x + bound.reach.y * pixel / min(texel.x, texel.y);
    // Windows are proved in aligned cells, which may reach past the contact where they do not.
    c.reach = bound.kind.x == BOUND_CONTACT ? reach + 2.0 : 2.0 * reach + 4.0;

    // The nine texels around the receiver.
    vec2 base = floor(c.at), g = c.plane.gradient;
    float most = 1.0, nearest = 1.0, farthest = -1.0; // of those that block
    bool all_block = true;
    for (int i = 0; i < 4; i++) {
        vec2 corner = base + vec2(i & 1, i >> 1);
        vec4 z = textureGather(shadow_map, corner / size);
        float there = c.plane.depth + dot(g, corner - c.at) - c.rounding;
        bvec4 blocks = lessThan(z, min(there + around(g), 1.0));
        all_block = all_block && all(blocks);
        vec4 low = mix(vec4(1.0), z, blocks), high = mix(vec4(-1.0), z, blocks);
        nearest = min(nearest, min(min(low.x, low.y), min(low.z, low.w)));
        farthest = max(farthest, max(max(high.x, high.y), max(high.z, high.w)));
    }
    // The bounds of loops are dynamic: software rasterisers run both sides of a branch. First the
    // four fours with the receiver's own texel; where an edge runs through that, the caster's inner
    // texels lie in one of eight directions.
    float steepest = abs(g.x) + abs(g.y) + farthest - nearest;
    bool close = farthest >= 0.0 && plane.depth - farthest < (c.reach + 1.0) * steepest;
    int fours = !close ? 0 : all_block ? 4 : 12;
    Caster caster = Caster(vec2(0.0), 0.0, 0.0, -1.0);
    for (int i = 0; i < fours; i++) {
        vec2 to = vec2((i & 1) == 0 ? 1.5 : 0.5, (i & 1) == 0 ? 0.5 : 1.5);
        to *= vec2((i & 2) == 0 ? 1.0 : -1.0, (i & 4) == 0 ? 1.0 : -1.0);
        vec2 corner = base + (i < 4 ? vec2(i & 1, i >> 1) : 0.5 + to);
        add_caster(c, corner, textureGather(shadow_map, corner / size), caster);
    }
    int found = caster.distance >= 0.0 ? 1 : 0;
    for (int i = 0; i < found; i++)
        most = past_caster(s, c, caster);
    // All of the light is hidden where all nine block and hold its image by the nearest of them;
    // a wider filter has an edge of its own there.
    vec2 image = light_filter_extent(light_linear(min(nearest, plane.depth)), s.p.z);
    if (bound.kind.x != BOUND_KERNEL && reach <= 2.5 && all_block &&
        all(lessThanEqual(image, texel)))
        most = 0.0;
#ifdef WINDOWS
    int windows = all_block && most > 0.0 ? 1 : 0;
    for (int i = 0; i < windows; i++) {
        // All light of an emitter is hidden when everything blocks in the window of its image by
        // the nearest caster in that window: grown from the least, it is as small as can be.
        vec2 window = bound.kind.x == BOUND_LIGHT ? texel : reach * texel;
        image = window;
        for (int round = 0; round < 5 && bound.kind.x == BOUND_LIGHT; round++) {
            window = max(window, 1.25 * image + 0.5 * texel);
            image = light_filter_extent(min(min_max_window(q, window).x, s.p.z), s.p.z);
        }
        if (all(lessThanEqual(image, window)) &&
            window_class(q, window, plane, c.rounding, 0.0, size) == WINDOW_BLOCKED)
            most = 0.0;
    }
#endif
    if (light.textured != 0 && most > 0.0)
        most = 1.0; // what is left has its own colours
    return most < 1.0 ? scalar_visibility(most) : vec4(UNBOUNDED);
}
