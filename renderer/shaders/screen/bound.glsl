// The most that a method may answer, from the exact depths of the map: what lets light through
// where casters touch receivers is bias, the texels that a caster's edge does not cover, and
// filters that reach past that edge or merge depths.
#include "contact.glsl"
#ifdef WINDOWS
#include "window.glsl"
#endif
#include "bound.def"

const float UNBOUNDED = 60000.0; // of a half float

#ifdef WINDOWS
// True when the plane of the four texels around the receiver hides all of the light: the light's
// image by it, the hull of those of its corners, is blocked, and by nothing before that plane,
// which another point of the light would see past.
bool hidden_by_plane(Surface s, Contact c, ReceiverPlane plane, vec2 q, vec2 texel, vec2 size)
{
    vec2 base = floor(c.at);
    Caster caster = Caster(vec2(0.0), 0.0, 0.0, -1.0);
    for (int i = 0; i < 4; i++) {
        vec2 corner = base + vec2(i & 1, i >> 1);
        add_caster(c, corner, textureGather(shadow_map, corner / size), caster);
    }
    float before = c.plane.depth - caster.depth;
    if (caster.distance < 0.0 || before <= c.rounding)
        return false;
    // A point of the light at l has its image at l * scale * (depth of the receiver - depth there).
    vec2 scale = light_filter_extent(light_linear(caster.depth), s.p.z) / before,
         slope = caster.slope / texel;
    vec2 low = vec2(0.0), high = vec2(0.0);
    bool beyond = true; // all of the light is, seen from the receiver
    for (int i = 0; i < 4; i++) {
        vec2 u = scale * vec2((i & 1) * 2 - 1, (i & 2) - 1);
        float closing = 1.0 + dot(slope, u);
        beyond = beyond && closing > 1e-3;
        vec2 image = u * before / max(closing, 1e-3);
        low = min(low, image);
        high = max(high, image);
    }
    vec2 middle = 0.5 * (low + high), extent = 0.5 * (high - low) + texel;
    ReceiverPlane there = plane;
    there.depth += dot(plane.gradient, middle);
    ReceiverPlane shield = ReceiverPlane(caster.depth + dot(slope, middle), slope);
    float bias = 4.0 * c.rounding + 0.02 * before;
    return beyond &&
           window_class(q + middle, extent, there, c.rounding, 0.0, size) == WINDOW_BLOCKED &&
           window_class(q + middle, extent, shield, bias, 0.0, size) == WINDOW_LIT;
}
#endif

vec4 visibility(Surface s)
{
    vec2 size = vec2(textureSize(shadow_map, 0)), texel = light_texel(shadow_map);
    vec2 q = light_project(s.p);
    if (!contact_is_known(s))
        return vec4(UNBOUNDED);
    ReceiverPlane plane = receiver_plane(s.p, s.n);
    float pixel = view.forward.w / (s.depth * view.eye.w);
    pixel *= light_parallel ? 1.0 : light.near_z / s.p.z;
    float reach = bound.reach.x + bound.reach.y * pixel / min(texel.x, texel.y);
    // Windows are proved in aligned cells, which may reach past the contact where they do not.
    Contact c = contact_of(
        s, plane, q, texel, bound.kind.x == BOUND_CONTACT ? reach + 2.0 : 2.0 * reach + 4.0);

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
    int shields = bound.kind.x == BOUND_LIGHT && a.all_block && most > 0.0 ? 1 : 0;
    for (int i = 0; i < shields; i++) {
        c.reach = 1e6;
        if (hidden_by_plane(s, c, plane, q, texel, size))
            most = 0.0;
    }
#endif
    if (light.textured != 0 && most > 0.0)
        most = 1.0; // what is left has its own colours
    return most < 1.0 ? scalar_visibility(most) : vec4(UNBOUNDED);
}
