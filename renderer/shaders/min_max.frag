// One level of a min-max pyramid of linear depth. A level of odd side drops nothing: the last texel
// of a row also takes the leftover column.
#include "light.glsl"
layout(binding = 7) uniform sampler2D source;
layout(std140, binding = 3) uniform LevelBlock {
    ivec4 level;
} from;
layout(location = 0) out vec2 range;

vec2 load(ivec2 at, int level)
{
#ifdef FROM_DEPTH
    // Where nothing is there is no depth, not even for receivers beyond the map's far plane.
    float d = texelFetch(source, at, level).r;
    return vec2(d < 1.0 ? light_linear(d) : 1e30);
#else
    return texelFetch(source, at, level).rg;
#endif
}

void main()
{
    ivec2 size = textureSize(source, from.level.x), base = 2 * ivec2(gl_FragCoord.xy);
    ivec2 last = size - 1;
    ivec2 reach = ivec2(base.x + 3 == size.x ? 2 : 1, base.y + 3 == size.y ? 2 : 1);
    range = vec2(1e30, -1e30);
    for (int y = 0; y <= reach.y; y++)
        for (int x = 0; x <= reach.x; x++) {
            vec2 v = load(min(base + ivec2(x, y), last), from.level.x);
            range = vec2(min(range.x, v.x), max(range.y, v.y));
        }
}
