#include "hard_lit.glsl"

vec4 visibility(Surface s)
{
    vec2 q = light_project(s.p);
    ReceiverPlane plane = receiver_plane(s.p, s.n);
    float bias = P(bias) * s.p.z * light_depth_slope(s.p.z), depth;
    bool lit = hard_lit(s, plane, q, light_texel(shadow_map), bias, depth);
    return scalar_visibility(lit ? 1.0 : P(share));
}
