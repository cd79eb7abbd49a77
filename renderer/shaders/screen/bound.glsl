// The most that a method may answer, from the exact depths of the map: what lets light through
// where casters touch receivers is bias, the texels that a caster's edge does not cover, and
// filters that reach past that edge or merge depths.
#include "contact.glsl"
#include "taps.glsl"
#ifdef WINDOWS
#include "window.glsl"
#endif
#include "bound.def"
layout(binding = UNIT_SOURCE) uniform sampler2DArray answers; // where the bound is written

const float UNBOUNDED = 60000.0; // of a half float
const int SURFACE_TAPS = 16, HALVINGS = 6;

// Light that the surface in the map leaves, of which it is known that it lies before the receiver's
// own texel: a point of the light is hidden when the way to it meets what the map shows there. That
// is sought on the plane of the texels around the receiver, and by halving the way up to it.
float past_surface(
    Surface s, Contact c, ReceiverPlane plane, Around a, vec2 q, vec2 texel, float answer)
{
    vec2 base = floor(c.at);
    Caster caster = Caster(vec2(0.0), 0.0, 0.0, -1.0);
    for (int i = 0; i < 4; i++) {
        vec2 corner = base + vec2(i & 1, i >> 1);
        add_caster(c, corner, a.z[i], caster);
    }
    float before = c.plane.depth - caster.depth;
    // A point of the light at e has its image at e * scale * (depth of the receiver - depth there).
    vec2 scale = light_filter_extent(light_linear(caster.depth), s.p.z),
         slope = caster.slope / texel;
    bool found = caster.distance >= 0.0 && before > c.rounding;
    // In a penumbra the light's corners mostly tell, or points of its rim, between which less than
    // a fiftieth of a disk can be seen; what would lower no answer is not counted on.
    int rim = light_shape == SHAPE_DISK ? 8 : 4, count = found ? rim : 0;
    float left = 0.0, all = 0.0;
    Taps taps = taps_begin(SURFACE_TAPS, vec2(0.5));
    for (int i = 0; i < count; i++) {
        float angle = 0.78539816 * float(i);
        vec2 e = light_shape == SHAPE_DISK ? vec2(cos(angle), sin(angle))
                                           : vec2((i & 1) * 2 - 1, (i & 2) - 1);
        if (i >= rim)
            e = taps_next(taps);
        float closing = 1.0 + dot(slope, scale * e) / before;
        vec2 image = scale * e / max(closing, 1e-3);
        vec2 texels = floor(c.at + image / texel) + 0.5 - c.at;
        float there = c.plane.depth + dot(c.plane.gradient, texels),
              shield = caster.depth + dot(caster.slope, texels);
        float z = texture(shadow_map, light_uv(q + image)).r;
        float near = 0.25 * (there - shield);
        bool shown = closing > 1e-3 && abs(z - shield) < max(near, c.rounding);
        // The way enters from below what the map shows, and ends above it or beyond the plane.
        float low = 0.0, high = closing > 0.25 ? 1.0 / closing : 0.0;
        int halvings = shown || high <= 0.0 || z < shield ? 0
                       : bound.kind.x == BOUND_SURFACE    ? HALVINGS
                                                          : 0;
        for (int k = 0; k < halvings; k++) {
            float middle = 0.5 * (low + high), depth = c.plane.depth - middle * before;
            z = texture(shadow_map, light_uv(q + middle * scale * e)).r;
            // Beside the receiver's own texel every caster's edge looks like that.
            shown = middle > 0.3 && abs(z - depth) < max(0.03 * before, c.rounding);
            low = z < depth ? middle : low;
            high = z < depth ? high : middle;
            halvings = shown ? 0 : halvings;
        }
        bool above = horizon_height(s.p, s.n, e) > 0.0;
        left += above && !shown ? 1.0 : 0.0;
        all += above ? 1.0 : 0.0;
        int points = rim + SURFACE_TAPS;
        bool enough = 2.0 * left >= answer * float(points) || (i < rim && left >= 0.5 * float(rim));
        count = enough ? 0 : i == rim - 1 ? points : count;
    }
    return count > rim ? min(2.0 * left / max(all, 1.0), 1.0) : 1.0;
}

vec4 visibility(Surface s)
{
    vec2 size = vec2(textureSize(shadow_map, 0)), texel = light_texel(shadow_map);
    vec2 q = light_project(s.p);
    // A pixel's own answer is read, and then written once.
    float answer = texelFetch(answers, ivec3(s.pixel, bound.kind.y), 0).a;
    if (answer <= 0.0 || !contact_is_known(s))
        return vec4(UNBOUNDED);
    ReceiverPlane plane = receiver_plane(s.p, s.n);
    float pixel = view.forward.w / (s.depth * view.eye.w);
    pixel *= light_parallel ? 1.0 : light.near_z / s.p.z;
    float reach = bound.reach.x + bound.reach.y * pixel / min(texel.x, texel.y);
    // Windows are proved in aligned cells, which may reach past the contact where they do not.
    bool cells = bound.kind.x == BOUND_KERNEL || bound.kind.x == BOUND_LIGHT;
    Contact c = contact_of(s, plane, q, texel, cells ? 2.0 * reach + 4.0 : reach + 2.0);

    Around a = look_around(s, c, look_beside(s, c, texel));
    float most = a.left;
    // A wider filter has an edge of its own there.
    if (bound.kind.x != BOUND_KERNEL && reach <= 2.5 && is_hidden(s, c, a, texel))
        most = 0.0;
#ifdef WINDOWS
    int windows = a.all_block && most > 0.0 ? 1 : 0;
    for (int i = 0; i < windows; i++) {
        // All light of an emitter is hidden when everything blocks in the window of its image by
        // the nearest caster in that window: grown from the least, it is as small as can be.
        vec2 window = bound.kind.x == BOUND_LIGHT ? texel : reach * texel;
        vec2 image = window;
        for (int round = 0; round < 5 && bound.kind.x == BOUND_LIGHT; round++) {
            window = max(window, 1.25 * image + 0.5 * texel);
            image = light_filter_extent(min(min_max_window(q, window).x, s.p.z), s.p.z);
        }
        if (all(lessThanEqual(image, window)) &&
            window_class(q, window, plane, c.rounding, 0.0, size) == WINDOW_BLOCKED)
            most = 0.0;
    }
#endif
    int follow = bound.kind.x >= BOUND_LIGHT && a.all_block && most > 0.0 ? 1 : 0;
    c.reach = follow > 0 ? 1e6 : c.reach;
    for (int i = 0; i < follow; i++)
        most = min(most, past_surface(s, c, plane, a, q, texel, answer));
    if (light.textured != 0 && most > 0.0)
        most = 1.0; // what is left has its own colours
    return most < 1.0 ? scalar_visibility(most) : vec4(UNBOUNDED);
}
