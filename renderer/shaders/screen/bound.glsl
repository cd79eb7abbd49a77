// The most that a method may answer, from the exact depths of the map: what lets light through
// where casters touch receivers is bias, the texels that a caster's edge does not cover, and
// filters that reach past that edge or merge depths.
#include "contact.glsl"
#ifdef WINDOWS
#include "window.glsl"
#endif
#include "bound.def"

const float UNBOUNDED = 60000.0; // of a half float

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
#endif
    if (light.textured != 0 && most > 0.0)
        most = 1.0; // what is left has its own colours
    return most < 1.0 ? scalar_visibility(most) : vec4(UNBOUNDED);
}
