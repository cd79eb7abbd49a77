// The map's texels as small casters: walks those that can hide part of the emitter from a receiver
// and hands each one's shadow on the emitter to the method, as a rectangle in emitter coordinates
// ([-1, 1]^2 or the unit disk), found by F2 of the light frame.
//
// The window comes from the bounds of depth in the pyramid, which is then walked as a quadtree: a
// node without a caster or beside the light ends there, one whose depths barely differ is a single
// caster, and the finest level is the first with at most P(kernel) texels across the window.
layout(binding = 7) uniform sampler2DArray caster_maps; // hardware depth, nearest layer first
#define MIN_MAX_LAYERED
#include "min_max.glsl"

// The method's: the part `share` of the rectangle low .. high is hidden.
void add_patch(vec2 low, vec2 high, float share);

const int LIT = 0, PENUMBRA = 1, UMBRA = 2;

struct PatchWindow {
    int answer;          // LIT and UMBRA are proven: nothing is left to walk
    vec2 q;              // the receiver on the map plane, m
    vec2 texel;          // m
    vec2 reach;          // half extent of the window, m
    vec2 emitter;        // half extent of the emitter, m; at least the smallest filter's
    ReceiverPlane plane;
    float bias, receiver_z;
};

PatchWindow patch_window(Surface s)
{
    PatchWindow w;
    w.q = light_project(s.p);
    w.texel = (light.rect.zw - light.rect.xy) / vec2(textureSize(caster_maps, 0).xy);
    w.plane = receiver_plane(s.p, s.n);
    w.bias = P(bias) * s.p.z * light_depth_slope(s.p.z);
    w.receiver_z = s.p.z;
    vec2 least = P(min_filter) * w.texel;
    float nearest_z;
    w.reach = min_max_search_extent(w.q, s.p.z, least, nearest_z);
    // An emitter whose shadow of the nearest caster is narrower than the least filter is widened:
    // points and contacts get an edge of that width instead of a division by zero.
    float scale = light_window_scale(min(nearest_z, s.p.z), s.p.z);
    w.emitter = max(light.extent, least / max(scale, 1e-20));
    vec2 range = min_max_window(w.q, w.reach);
    vec2 low = w.q - w.reach, high = w.q + w.reach;
    bool inside = all(greaterThan(low, light.rect.xy)) && all(lessThan(high, light.rect.zw));
    float least_plane = w.plane.depth - dot(abs(w.plane.gradient), w.reach) - w.bias;
    bool all_hide = inside && range.y < s.p.z && light_depth(range.y) < min(least_plane, 1.0 - w.bias);
    w.answer = range.x >= s.p.z ? LIT : all_hide ? UMBRA : PENUMBRA;
    return w;
}

float caster_depth(ivec2 at, int layer)
{
    ivec2 size = textureSize(caster_maps, 0).xy;
    float d = texelFetch(caster_maps, ivec3(min(at, size - 1), layer), 0).r;
    return any(greaterThanEqual(at, size)) ? 1.0 : d;
}

#if P_fill != 0 // none
// Slopes are seen as steps. When a neighbour is a caster at about the same depth, the two share
// their border: `extend` (Guennebaud et al. 2006) closes gaps, `join` also undoes overlaps.
float filled_border(PatchWindow w, ivec2 neighbour, int layer, int level, float limit, float z,
    float border, float emitter, float own)
{
    neighbour = max(neighbour, ivec2(0));
    float d = level > 0 ? texelFetch(min_max_pyramid, ivec3(neighbour, layer), level - 1).r
                        : caster_depth(neighbour, layer);
    float its_z = light_linear(d);
    bool near = d < limit && abs(its_z - z) < P(gap) * z;
    float shared_border =
        border / (max(light_window_scale(its_z, w.receiver_z), 1e-20) * emitter);
#if P_fill == 1
    shared_border = min(own, shared_border);
#endif
    return near ? shared_border : own;
}
#endif

// Order of the quadtree: children first, then the sibling, then whoever follows the parent.
void next_node(inout ivec2 at, inout int level)
{
    int full = findLSB(~(at.x & at.y)); // ends of how many rows of siblings end here
    at >>= full;
    level += full;
    at += (at.x & 1) == 0 ? ivec2(1, 0) : ivec2(-1, 1);
}

void walk_quadtree(PatchWindow w, int layer, ivec2 root, int root_level, int finest)
{
    ivec2 at = root;
    int level = root_level;
    bool walking = true;
    while (walking) {
        ivec2 middle = (at << level) + ((1 << level) >> 1);
        float d_middle = caster_depth(middle, layer);
        vec3 d = level > 0 ? texelFetch(min_max_pyramid, ivec3(at, layer), level - 1).rgb
                           : vec3(d_middle);
        vec2 low = light.rect.xy + vec2(at << level) * w.texel - w.q;
        vec2 high = light.rect.xy + vec2((at + 1) << level) * w.texel - w.q;
        float plane = min(w.plane.depth + dot(w.plane.gradient, 0.5 * (low + high)), 1.0);
        float slack = level > 0 ? dot(abs(w.plane.gradient), 0.5 * (high - low)) : 0.0;
        // Who lies before the receiver and before its plane hides.
        float least = min(plane - slack - w.bias, w.plane.depth);
        float most = min(min(plane + slack, 1.0) - w.bias, w.plane.depth);
        float limit = min(plane - w.bias, w.plane.depth);
        bool whole = d.y < least;
        float near_scale = light_window_scale(light_linear(d.x), w.receiver_z);
        float far_scale = light_window_scale(light_linear(d.y), w.receiver_z);
        // The receiver's own plane: depth is linear over the map, so the mean is the middle's.
        bool own = d.x >= plane - slack - w.bias && d.y <= plane + slack + w.bias &&
            abs(d.z - plane) <= w.bias;
        vec2 edge = near_scale * w.emitter;
        bool beside = any(greaterThan(low, edge)) || any(lessThan(high, -edge));
        bool open = d.x < most && !own && !beside;
        bool leaf = level == finest || (whole && near_scale - far_scale <= 0.016 * far_scale);
        // Part of a coarse texel: the near depth hides as much as makes the mean of the two depths.
        // Where the plane runs through the texel the middle decides.
        bool mixed = !whole && d.x < least;
        float share = mixed ? (d.y - d.z) / max(d.y - d.x, 1e-20) : 1.0;
        float depth = whole ? d.z : mixed ? d.x : d_middle;
        // A loop, because software rasterisers skip one but not a branch.
        for (bool patch_here = open && leaf && depth < limit; patch_here; patch_here = false) {
            float z = light_linear(depth);
            vec2 scale = 1.0 / (max(light_window_scale(z, w.receiver_z), 1e-20) * w.emitter);
            vec2 a = low * scale, b = high * scale;
#if P_fill != 0
            a.x = filled_border(
                w, at - ivec2(1, 0), layer, level, limit, z, low.x, w.emitter.x, a.x);
            a.y = filled_border(
                w, at - ivec2(0, 1), layer, level, limit, z, low.y, w.emitter.y, a.y);
#endif
            add_patch(a, b, share);
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

void walk_patches(PatchWindow w)
{
    ivec2 end = textureSize(caster_maps, 0).xy - 1;
    ivec2 first = clamp(ivec2(floor((w.q - w.reach - light.rect.xy) / w.texel)), ivec2(0), end);
    ivec2 last = clamp(ivec2(floor((w.q + w.reach - light.rect.xy) / w.texel)), ivec2(0), end);
    ivec2 span = last - first + 1;
    float across = float(max(span.x, span.y));
    int coarsest = textureQueryLevels(min_max_pyramid);
    int finest = clamp(int(ceil(log2(across / float(P(kernel))))), 0, coarsest);
    // Two nodes on each axis hold the window.
    int root = clamp(int(ceil(log2(across))), finest, coarsest);
    first >>= root;
    last >>= root;
    if (w.answer != PENUMBRA)
        last = first - 1;
    for (int layer = 0; layer < P(layers); layer++)
        for (int v = first.y; v <= last.y; v++)
            for (int u = first.x; u <= last.x; u++)
                walk_quadtree(w, layer, ivec2(u, v), root, finest);
}
