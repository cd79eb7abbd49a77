// The map's texels as small casters: walks those that can hide part of the emitter from a receiver
// and hands each one's shadow on the emitter to the method, as a rectangle in emitter coordinates
// ([-1, 1]^2 or the unit disk), found by F2 (docs/light-space.md).
//
// The window comes from the bounds of depth in the pyramid, which is then walked as a quadtree: a
// node without a caster or beside the light ends there, and one whose depths barely differ, or that
// is smaller than 1 / P(kernel) of the light as seen past it, is a single caster. PATCHES_APART:
// the method has no rows P(fill) and P(gap), and leaves gaps between casters alone.
#include "patches.def"
// Hardware depth, nearest layer first.
layout(binding = UNIT_CASTERS) uniform sampler2DArray caster_maps;
#define MIN_MAX_LAYERED
#include "min_max.glsl"
#include "horizon.glsl"

// The method's: the part `share` of the rectangle low .. high is hidden.
void add_patch(vec2 low, vec2 high, float share);

const int LIT = 0, PENUMBRA = 1, UMBRA = 2;

// F2's W is linear in hardware depth, W = (depth of the receiver - d) * W's range, so with map
// positions divided by that range and the emitter, e = (l - q) / (range emitter), the emitter point
// that l hides is e / (depth - d).
struct PatchWindow {
    int answer;    // LIT and UMBRA are proven: nothing is left to walk
    vec2 q;        // the receiver on the map plane, m
    vec2 reach;    // half extent of the window, m
    vec2 origin;   // e of the map's corner
    vec2 texel;    // e per texel
    float depth;   // of the receiver
    vec2 gradient; // of the depth of its plane, per e
    float bias;
    float above;      // share of the emitter above the receiver's horizon; patches hide of that
    HorizonBack back; // gradient per e
    float widest;     // depth - d of the nearest caster: its shadow is as wide as the window
    float narrowest;  // the least that was met: of the sharpest shadow
};

PatchWindow patch_window(Surface s)
{
    PatchWindow w;
    w.q = light_project(s.p);
    vec2 texel = (light.rect.zw - light.rect.xy) / vec2(textureSize(caster_maps, 0).xy);
    ReceiverPlane plane = receiver_plane(s.p, s.n);
    w.depth = plane.depth;
    w.bias = surface_bias(s, P(bias)) * light_depth_slope(s.p.z);
    vec2 least = P(min_filter) * texel;
    float nearest_z;
    w.reach = min_max_search_extent(w.q, s.p.z, least, nearest_z);
    // An emitter whose shadow of the nearest caster is narrower than the least filter is widened:
    // points and contacts get an edge of that width instead of a division by zero.
    float nearest = light_window_scale(min(nearest_z, s.p.z), s.p.z);
    vec2 emitter = max(light.extent, least / max(nearest, 1e-20));
    float range = (light.far_z - light.near_z) * (light_parallel ? 1.0 : 1.0 / light.far_z);
    vec2 unit = range * emitter;
    w.origin = (light.rect.xy - w.q) / unit;
    w.texel = texel / unit;
    w.gradient = plane.gradient * unit;
    w.above = max(horizon_share(s.p, s.n), 1e-3);
    w.back = horizon_back(s.p, s.n, w.bias);
    w.back.gradient *= unit;
    vec2 z = min_max_window(w.q, w.reach);
    vec2 low = w.q - w.reach, high = w.q + w.reach;
    bool inside = all(greaterThan(low, light.rect.xy)) && all(lessThan(high, light.rect.zw));
    float least_plane = min(plane.depth - dot(abs(plane.gradient), w.reach), 1.0) - w.bias;
    bool all_hide = inside && z.y < s.p.z && light_depth(z.y) < least_plane && w.back.depth < 0.0;
    w.answer = z.x >= s.p.z ? LIT : all_hide ? UMBRA : PENUMBRA;
    w.widest = w.narrowest = max(w.depth - light_depth(min(nearest_z, s.p.z)), 1e-20);
    return w;
}

float caster_depth(ivec2 at, int layer)
{
    ivec2 size = textureSize(caster_maps, 0).xy;
    float d = texelFetch(caster_maps, ivec3(min(at, size - 1), layer), 0).r;
    return any(greaterThanEqual(at, size)) ? 1.0 : d;
}

#ifndef PATCHES_APART
// Slopes are seen as steps. When a neighbour is a caster at about the same depth, the two share
// their border: `extend` (Guennebaud et al. 2006) closes gaps, `join` also undoes overlaps.
float filled_border(PatchWindow w, ivec2 neighbour, int layer, int level, float limit, float d,
    float border, float own)
{
    neighbour = max(neighbour, ivec2(0));
    float its = level > 0 ? texelFetch(min_max_pyramid, ivec3(neighbour, layer), level - 1).r
                          : caster_depth(neighbour, layer);
    // dz / z in hardware depth; a parallel light has no distance, so there it is a share of the
    // range.
    float scale = light_parallel ? 1.0 : light.far_z / (light.far_z - light.near_z) - d;
    bool near = its < limit && abs(its - d) < P(gap) * scale;
    float shared_border = border / max(w.depth - its, 1e-20);
    if (P(fill) == FILL_EXTEND)
        shared_border = min(own, shared_border);
    return near ? shared_border : own;
}
#endif

// Order of the quadtree: children first, then the sibling, then whoever follows the parent.
void next_node(inout ivec2 at, inout int level)
{
    int full = findLSB(~(at.x & at.y)); // how many rows of siblings end here
    at >>= full;
    level += full;
    at += (at.x & 1) == 0 ? ivec2(1, 0) : ivec2(-1, 1);
}

void walk_quadtree(inout PatchWindow w, int layer, ivec2 root, int root_level)
{
    ivec2 at = root;
    int level = root_level;
    bool walking = true;
    while (walking) {
        float middle = caster_depth((at << level) + ((1 << level) >> 1), layer);
        vec3 d = texelFetch(min_max_pyramid, ivec3(at, layer), max(level - 1, 0)).rgb;
        d = level > 0 ? d : vec3(middle);
        // Neighbours compute a common border alike, to the last bit: points must not fall between.
        vec2 low = w.origin + vec2(at << level) * w.texel;
        vec2 high = w.origin + vec2((at + 1) << level) * w.texel,
             side = float(1 << level) * w.texel;
        float plane = min(w.depth + dot(w.gradient, low + 0.5 * side), 1.0);
        float back = back_depth(w.back, low + 0.5 * side);
        float slack = level > 0 ? 0.5 * dot(abs(w.gradient), side) : 0.0;
        float back_slack = level > 0 ? 0.5 * dot(abs(w.back.gradient), side) : 0.0;
        // Who lies before the receiver and before its plane hides.
        float least = min(plane - slack - w.bias, w.depth);
        float most = min(min(plane + slack, 1.0) - w.bias, w.depth);
        bool whole = d.y < least && d.x > back + back_slack;
        // The receiver's own plane: depth is linear over the map, so the mean is the middle's.
        bool own = d.x >= plane - slack - w.bias && d.y <= plane + slack + w.bias &&
                   abs(d.z - plane) <= w.bias;
        float widest = w.depth - d.x;
        bool beside = any(greaterThan(low, vec2(widest))) || any(lessThan(high, vec2(-widest)));
        bool open = d.x < most && d.y > back - back_slack && !own && !beside;
        // Fine enough for its own shadow: casters near the receiver need finer texels than the
        // nearest to the light does.
        bool leaf = level == 0 || max(side.x, side.y) * 0.5 * float(P(kernel)) <= widest ||
                    (whole && d.y - d.x <= 0.016 * (w.depth - d.y));
        if (open && leaf) {
            // Part of a coarse texel: the near depth hides as much as makes the mean of the two
            // depths. Where the plane runs through the texel its middle decides.
            bool mixed = !whole && d.x < least && w.back.depth < 0.0;
            float share = mixed ? (d.y - d.z) / max(d.y - d.x, 1e-20) : 1.0;
            float limit = min(plane - w.bias, w.depth);
            float depth = whole ? d.z : mixed ? d.x : middle;
            float below = max(w.depth - depth, 1e-20);
            vec2 a = low / below, b = high / below;
#ifndef PATCHES_APART
            if (P(fill) != FILL_NONE) {
                a.x = filled_border(w, at - ivec2(1, 0), layer, level, limit, depth, low.x, a.x);
                a.y = filled_border(w, at - ivec2(0, 1), layer, level, limit, depth, low.y, a.y);
            }
#endif
            if (depth < limit && depth > back) {
                add_patch(a, b, share);
                w.narrowest = min(w.narrowest, below);
            }
        }
        if (open && !leaf) {
            at <<= 1;
            level--;
        } else if (level == root_level) {
            walking = false;
        } else {
            next_node(at, level);
            walking = level < root_level;
        }
    }
}

void walk_patches(inout PatchWindow w)
{
    ivec2 end = textureSize(caster_maps, 0).xy - 1;
    vec2 scale = vec2(end + 1) / (light.rect.zw - light.rect.xy);
    ivec2 first = clamp(ivec2(floor((w.q - w.reach - light.rect.xy) * scale)), ivec2(0), end);
    ivec2 last = clamp(ivec2(floor((w.q + w.reach - light.rect.xy) * scale)), ivec2(0), end);
    ivec2 span = last - first + 1;
    float across = float(max(span.x, span.y));
    int coarsest = textureQueryLevels(min_max_pyramid);
    // Two nodes on each axis hold the window.
    int root = clamp(int(ceil(log2(across))), 0, coarsest);
    first >>= root;
    last >>= root;
    if (w.answer != PENUMBRA)
        last = first - 1;
    for (int layer = 0; layer < int(P(layers)); layer++)
        for (int v = first.y; v <= last.y; v++)
            for (int u = first.x; u <= last.x; u++)
                walk_quadtree(w, layer, ivec2(u, v), root);
}
