// One fragment per tile: reversed depth of its farthest and nearest receiver; 0: none.
#include "cascaded_tiles.def"
layout(binding = UNIT_DEPTH) uniform sampler2D g_depth;
layout(location = 0) out vec2 range;

void main()
{
    ivec2 first = ivec2(gl_FragCoord.xy) * tiles.tile.x;
    ivec2 end = min(first + tiles.tile.x, textureSize(g_depth, 0));
    float low = 1e30, high = 0.0;
    for (int y = first.y; y < end.y; y++)
        for (int x = first.x; x < end.x; x++) {
            float d = texelFetch(g_depth, ivec2(x, y), 0).r;
            low = d > 0.0 ? min(low, d) : low;
            high = max(high, d);
        }
    range = high > 0.0 ? vec2(low, high) : vec2(0.0);
}
