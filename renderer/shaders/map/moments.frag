// Moments of the depth under each texel of the map. VARIANCE: (z, z^2) of unit depth, the square
// with the variance of a plane inside the texel; EXPONENTIAL: both warps and their squares; else
// four moments of depth in [-1, 1], PACKED as integers want them.
#include "depth_unit.glsl"
#include "moments.glsl"
#include "moments.def"
layout(binding = UNIT_SOURCE) uniform sampler2D source; // hardware depth
layout(location = 0) out vec4 result;

float load(ivec2 at)
{
    ivec2 last = textureSize(source, 0) - 1;
    bool inside = all(equal(clamp(at, ivec2(0), last), at));
    return inside ? depth_unit(texelFetch(source, at, 0).r) : 1.0;
}

// The smaller one of both one-sided differences: the slope of the surface, not of a silhouette.
float slope(float before, float here, float after)
{
    return min(abs(after - here), abs(here - before));
}

void main()
{
    ivec2 at = ivec2(gl_FragCoord.xy) - int(moment.exponents.z);
    float u = load(at);
#if defined(VARIANCE)
    vec2 d = vec2(slope(load(at - ivec2(1, 0)), u, load(at + ivec2(1, 0))),
        slope(load(at - ivec2(0, 1)), u, load(at + ivec2(0, 1))));
    result = vec4(u, u * u + 0.25 * dot(d, d), 0.0, 1.0);
#elif defined(EXPONENTIAL)
    vec2 w = exponential_warp(2.0 * u - 1.0, moment.exponents.xy);
    result = vec4(w, w * w);
#else
    float z = 2.0 * u - 1.0, z2 = z * z;
    vec4 b = vec4(z, z2, z2 * z, z2 * z2);
    result = moments_pack(b);
#endif
}
