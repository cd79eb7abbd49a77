// The receiver under a pixel as a shadow map sees it.
struct Receiver {
    vec2 q; // where the map shows it, m on the map plane
    ReceiverPlane plane;
    float bias;    // hardware depth
    vec2 map_size; // texels
    vec2 metres;   // per texel
};

Receiver receiver_of(Surface s, vec2 map_size)
{
    Receiver r;
    r.q = light_project(s.p);
    r.plane = receiver_plane(s.p, s.n);
    r.bias = surface_bias(s, P(bias)) * light_depth_slope(s.p.z);
    r.map_size = map_size;
    r.metres = (light.rect.zw - light.rect.xy) / map_size;
    return r;
}
