// One comparison seen from the light's centre, on the receiver's plane at the texel's own centre.
bool hard_lit(Surface s, ReceiverPlane plane, vec2 q, vec2 texel, float bias, out float depth)
{
    vec2 center = (floor((q - light.rect.xy) / texel) + 0.5) * texel + light.rect.xy;
    depth = texture(shadow_map, light_uv(q)).r;
    return plane_depth(plane, center - q, bias) <= depth;
}
