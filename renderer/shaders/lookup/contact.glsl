// Contacts. Hardware depth of a plane is linear over the map (F6), so four texels of one caster
// give its plane beyond its edge too. Where it crosses the receiver's plane within reach, the two
// touch there, and the receiver sees only what of the light lies on its own side of the caster.
#include "horizon.glsl"

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

Contact contact_of(Surface s, ReceiverPlane plane, vec2 q, vec2 texel, float reach)
{
    Contact c;
    c.at = (q - light.rect.xy) / texel;
    c.plane = ReceiverPlane(plane.depth, plane.gradient * texel);
    c.rounding = 1e-6 + max(4e-6 * s.p.z, surface_rounding(s)) * light_depth_slope(s.p.z);
    c.reach = reach;
    return c;
}

// False where the receiver's plane says too little of what is in the map.
bool contact_is_known(Surface s)
{
    return light_parallel ? -s.n.z >= 0.05 : -dot(s.n, s.p) >= 0.05 * length(s.p);
}

// The least difference in slope of planes that meet at the angle of past_caster(), hardware depth
// per texel: slopes in a map are tangents of angles from the ray, that of the receiver is known to
// be less than 20 (contact_is_known), and casters lie within reach.
float least_steepness(Surface s, Contact c, vec2 texel)
{
    float least = 1.1 * min(texel.x, texel.y) / (light.far_z - light.near_z);
    float nearer = 1.0 + 20.0 * c.reach * max(texel.x, texel.y) / light.near_z;
    return light_parallel ? least : least * light.far_z * s.p.z / (dot(s.p, s.p) * nearer);
}

// What the texels show that lie beside the receiver's own: every four of a caster has one of them.
struct Beside {
    bool casters;   // steep ones may be there
    bool all_block; // perhaps all nine around the receiver
};

Beside look_beside(Surface s, Contact c, vec2 texel)
{
    vec2 middle = floor(c.at) + 0.5, g = c.plane.gradient;
    ivec2 last = textureSize(shadow_map, 0) - 1, at = clamp(ivec2(middle), ivec2(0), last);
    ivec2 low = max(at - 1, ivec2(0)), high = min(at + 1, last);
    vec4 z = vec4(texelFetch(shadow_map, ivec2(high.x, at.y), 0).r,
        texelFetch(shadow_map, ivec2(low.x, at.y), 0).r,
        texelFetch(shadow_map, ivec2(at.x, high.y), 0).r,
        texelFetch(shadow_map, ivec2(at.x, low.y), 0).r);
    vec4 there = c.plane.depth + dot(g, middle - c.at) + vec4(g.x, -g.x, g.y, -g.y);
    vec4 before = min(there, 1.0) - z;
    float clear = c.rounding + 0.02 * max(abs(g.x), abs(g.y)) + 0.1 * least_steepness(s, c, texel);
    return Beside(
        any(greaterThan(before, vec4(clear))), all(greaterThan(before, vec4(0.5 * c.rounding))));
}

// What the nine texels around the receiver show.
struct Around {
    bool all_block;
    float nearest; // of those that block
    float left;    // of the light, by a caster that touches the receiver
    vec4 z[4];     // around each of its own texel's corners
};

Around look_around(Surface s, Contact c, Beside beside)
{
    vec2 size = vec2(textureSize(shadow_map, 0)), base = floor(c.at), g = c.plane.gradient;
    Around a;
    a.nearest = a.left = 1.0;
    // The bounds of loops are dynamic: software rasterisers run both sides of a branch.
    int corners = beside.casters || beside.all_block ? 4 : 0;
    float farthest = -1.0;
    a.all_block = corners > 0;
    for (int i = 0; i < corners; i++) {
        vec2 corner = base + vec2(i & 1, i >> 1);
        vec4 z = textureGather(shadow_map, corner / size);
        float there = c.plane.depth + dot(g, corner - c.at) - c.rounding;
        bvec4 blocks = lessThan(z, min(there + around(g), 1.0));
        a.all_block = a.all_block && all(blocks);
        a.z[i] = z;
        vec4 low = mix(vec4(1.0), z, blocks), high = mix(vec4(-1.0), z, blocks);
        a.nearest = min(a.nearest, min(min(low.x, low.y), min(low.z, low.w)));
        farthest = max(farthest, max(max(high.x, high.y), max(high.z, high.w)));
    }
    // First the four fours with the receiver's own texel; where an edge runs through that, the
    // caster's inner texels lie in one of eight directions.
    float steepest = abs(g.x) + abs(g.y) + farthest - a.nearest;
    bool close = farthest >= 0.0 && c.plane.depth - farthest < (c.reach + 1.0) * steepest;
    int fours = !close || !beside.casters ? 0 : a.all_block ? 4 : 12;
    Caster caster = Caster(vec2(0.0), 0.0, 0.0, -1.0);
    for (int i = 0; i < fours; i++) {
        vec2 to = vec2((i & 1) == 0 ? 1.5 : 0.5, (i & 1) == 0 ? 0.5 : 1.5);
        to *= vec2((i & 2) == 0 ? 1.0 : -1.0, (i & 4) == 0 ? 1.0 : -1.0);
        vec2 corner = base + (i < 4 ? vec2(i & 1, i >> 1) : 0.5 + to);
        add_caster(c, corner, textureGather(shadow_map, corner / size), caster);
    }
    int found = caster.distance >= 0.0 ? 1 : 0;
    for (int i = 0; i < found; i++)
        a.left = past_caster(s, c, caster);
    return a;
}

// All of the light is hidden where all nine block and hold its image by the nearest of them.
bool is_hidden(Surface s, Contact c, Around a, vec2 texel)
{
    vec2 image = light_filter_extent(light_linear(min(a.nearest, c.plane.depth)), s.p.z);
    return a.all_block && all(lessThanEqual(image, texel));
}
