// Williams 1978, with the receiver's plane evaluated at the texel's own centre: a planar receiver
// then never shadows itself, whatever its slope. What that and the bias leave lit where a caster
// touches the receiver is taken away in a second step (TOUCHED), in those tiles of the image in
// which the first has met such a receiver and answered less than 0: a last pass over everything
// would cost more than the method.
#include "contact.glsl"

const float REACH = 1.0; // texels

vec4 visibility(Surface s)
{
    vec2 q = light_project(s.p), texel = light_texel(shadow_map);
    ReceiverPlane plane = receiver_plane(s.p, s.n);
    vec2 center = (floor((q - light.rect.xy) / texel) + 0.5) * texel + light.rect.xy;
    float bias = surface_bias(s, P(bias)) * light_depth_slope(s.p.z);
    float z = texture(shadow_map, light_uv(q)).r;
    float lit = plane_depth(plane, center - q, bias) <= z ? 1.0 : 0.0;
    Contact c = contact_of(s, plane, q, texel, REACH + 2.0);
    Beside beside = look_beside(s, c, texel);
    bool touched = lit > 0.0 && contact_is_known(s) && (beside.casters || beside.all_block);
#ifdef TOUCHED
    Around a = look_around(s, c, beside);
    float left = is_hidden(s, c, a, texel) ? 0.0 : a.left;
    left = light.textured != 0 && left > 0.0 ? 1.0 : left; // what is left has its own colours
    lit = touched ? left : lit;
#else
    lit = touched ? -lit : lit;
#endif
    return scalar_visibility(lit);
}
