// One level of a min-max pyramid of linear depth. A level of odd side drops nothing: the last texel
// of a row also takes the leftover column.
#include "light.glsl"
#include "level.def"
layout(binding = UNIT_SOURCE) uniform sampler2D source;
layout(location = 0) out vec2 range;

#ifdef FROM_DEPTH
// Where nothing is there is no depth, not even for receivers beyond the map's far plane.
float linear(float d)
{
    return d < 1.0 ? light_linear(d) : 1e30;
}
#endif

vec2 load(ivec2 at, int level)
{
#ifdef FROM_DEPTH
    return vec2(linear(texelFetch(source, at, level).r));
#else
    return texelFetch(source, at, level).rg;
#endif
}

vec2 both(vec2 a, vec2 b)
{
    return vec2(min(a.x, b.x), max(a.y, b.y));
}

void main()
{
    ivec2 size = textureSize(source, from.level.x), base = 2 * ivec2(gl_FragCoord.xy);
#ifdef EVEN // nothing is left over, and software rasterisers are slow at loops of unknown length
#ifdef FROM_DEPTH
    // Linear depth grows with hardware depth: two conversions are enough.
    vec4 d = textureGather(source, (vec2(base) + 1.0) / vec2(size));
    range =
        vec2(linear(min(min(d.x, d.y), min(d.z, d.w))), linear(max(max(d.x, d.y), max(d.z, d.w))));
#else
    range = both(both(load(base, from.level.x), load(base + ivec2(1, 0), from.level.x)),
        both(load(base + ivec2(0, 1), from.level.x), load(base + ivec2(1, 1), from.level.x)));
#endif
#else
    ivec2 last = size - 1;
    ivec2 reach = ivec2(base.x + 3 == size.x ? 2 : 1, base.y + 3 == size.y ? 2 : 1);
    range = vec2(1e30, -1e30);
    for (int y = 0; y <= reach.y; y++)
        for (int x = 0; x <= reach.x; x++)
            range = both(range, load(min(base + ivec2(x, y), last), from.level.x));
#endif
}
