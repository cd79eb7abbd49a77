// Unit vectors as points of an octahedron's net (Meyer et al. 2010, Cigolle et al. 2014), in [0,
// 1]^2 so that they fit 16-bit unorm targets: half floats are ten times too coarse for receiver
// planes.
vec2 octahedral_encode(vec3 n)
{
    n /= abs(n.x) + abs(n.y) + abs(n.z);
    vec2 folded = (1.0 - abs(n.yx)) * vec2(n.x >= 0.0 ? 1.0 : -1.0, n.y >= 0.0 ? 1.0 : -1.0);
    return (n.z >= 0.0 ? n.xy : folded) * 0.5 + 0.5;
}

// Of any length.
vec3 octahedral_direction(vec2 e)
{
    e = 2.0 * e - 1.0;
    vec3 n = vec3(e, 1.0 - abs(e.x) - abs(e.y));
    float t = max(-n.z, 0.0);
    n.xy += vec2(n.x >= 0.0 ? -t : t, n.y >= 0.0 ? -t : t);
    return n;
}

vec3 octahedral_decode(vec2 e)
{
    return normalize(octahedral_direction(e));
}
