// One level of one layer's pyramid: min, max and mean of hardware depth. Sides are powers of two;
// beyond the map nothing is.
#include "level.def"
layout(binding = UNIT_SOURCE) uniform sampler2DArray finer;
layout(location = 0) out vec4 range;

vec3 load(ivec2 at)
{
    ivec2 size = textureSize(finer, from.level.x).xy;
    vec4 v = texelFetch(finer, ivec3(min(at, size - 1), from.level.y), from.level.x);
#ifdef FROM_DEPTH
    return vec3(any(greaterThanEqual(at, size)) ? 1.0 : v.r);
#else
    return v.rgb;
#endif
}

void main()
{
    ivec2 at = 2 * ivec2(gl_FragCoord.xy);
    vec3 a = load(at), b = load(at + ivec2(1, 0)), c = load(at + ivec2(0, 1)), d = load(at + 1);
    float least = min(min(a.x, b.x), min(c.x, d.x)), most = max(max(a.y, b.y), max(c.y, d.y));
    // Rounding may not leave the bounds: equal depths have that mean exactly.
    range = vec4(least, most, clamp(0.25 * (a.z + b.z + c.z + d.z), least, most), 0.0);
}
