// Reeves et al. 1987: V = mean of [plane depth <= map depth] over a square of the map. The pattern
// is the same for every pixel, so there is no noise; a bilinear weight per tap hides its steps.
#include "sequences.glsl"

float compare_bilinear(ReceiverPlane plane, vec2 offset, vec2 l, vec2 texel, float bias)
{
    vec2 at = (l + offset - light.rect.xy) / texel - 0.5;
    vec2 base = floor(at), f = at - base;
    vec2 uv = (base + 1.0) * texel / (light.rect.zw - light.rect.xy);
    vec4 z = textureGather(shadow_map, uv); // (0,1) (1,1) (1,0) (0,0)
    vec2 near = (base + 0.5) * texel + light.rect.xy - l, far = near + texel;
    vec4 r = vec4(plane_depth(plane, vec2(near.x, far.y), bias), plane_depth(plane, far, bias),
        plane_depth(plane, vec2(far.x, near.y), bias), plane_depth(plane, near, bias));
    vec4 lit = vec4(lessThanEqual(r, z));
    return mix(mix(lit.w, lit.z, f.x), mix(lit.x, lit.y, f.x), f.y);
}

vec4 visibility(Surface s)
{
    vec2 q = light_project(s.p), texel = light_texel(shadow_map);
    ReceiverPlane plane = receiver_plane(s.p, s.n);
    float bias = surface_bias(s, P(bias)) * light_depth_slope(s.p.z), sum = 0.0;
    vec2 at = vec2(0.5);
    for (int i = 0; i < int(P(taps)); i++) {
        sum += compare_bilinear(plane, (2.0 * at - 1.0) * P(radius) * texel, q, texel, bias);
        at = fract(at + R2_STEP);
    }
    return scalar_visibility(sum / float(P(taps)));
}
