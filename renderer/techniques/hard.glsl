// Williams 1978, with the receiver's plane evaluated at the texel's own centre: a planar receiver
// then never shadows itself, whatever its slope.
vec4 visibility(Surface s)
{
    vec2 q = light_project(s.p), texel = light_texel(shadow_map);
    ReceiverPlane plane = receiver_plane(s.p, s.n);
    vec2 center = (floor((q - light.rect.xy) / texel) + 0.5) * texel + light.rect.xy;
    float bias = P(bias) * s.p.z * light_depth_slope(s.p.z);
    float z = texture(shadow_map, light_uv(q)).r;
    return scalar_visibility(plane_depth(plane, center - q, bias) <= z ? 1.0 : 0.0);
}
