// Integer hash with good avalanche (Jarzynski and Olano 2020, pcg3d).
uvec3 hash3(uvec3 v)
{
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v ^= v >> 16u;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    return v;
}

float unit_float(uint bits)
{
    return float(bits >> 8) * (1.0 / 16777216.0);
}

// In [0, 1), for each surface that a pixel meets: those behind one another are there independently.
float pixel_threshold(vec3 at, uint seed)
{
    return unit_float(hash3(uvec3(at.xy, seed + floatBitsToUint(at.z))).x);
}
