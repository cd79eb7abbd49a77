// One level of the edge pyramid: the largest W (0: no edge), and the means of edges and of their W.
// A level of odd side drops nothing: the last texel of a row also takes the leftover column.
#include "level.def"
layout(binding = UNIT_SOURCE) uniform sampler2D source;
layout(location = 0) out vec4 edge;

void main()
{
    ivec2 size = textureSize(source, from.level.x), base = 2 * ivec2(gl_FragCoord.xy);
    ivec2 reach = ivec2(base.x + 3 == size.x ? 2 : 1, base.y + 3 == size.y ? 2 : 1);
    vec4 sum = vec4(0.0);
    float count = 0.0;
    for (int y = 0; y <= reach.y; y++)
        for (int x = 0; x <= reach.x; x++) {
            vec4 v = texelFetch(source, min(base + ivec2(x, y), size - 1), from.level.x);
            sum = vec4(max(sum.x, v.x), sum.yzw + v.yzw);
            count += 1.0;
        }
    edge = vec4(sum.x, sum.yzw / count);
}
