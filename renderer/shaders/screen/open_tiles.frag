// One fragment per tile: is one of its answers less than 0, which leaves it open?
#include "open_tiles.def"
#include "tile_class.def"
layout(binding = UNIT_SOURCE) uniform sampler2DArray answers;
layout(location = 0) out vec4 tile_class; // class / 255

void main()
{
    ivec2 first = ivec2(gl_FragCoord.xy) * open_tiles.tile.x;
    ivec2 end = min(first + open_tiles.tile.x, textureSize(answers, 0).xy);
    float least = 0.0;
    for (int y = first.y; y < end.y; y++)
        for (int x = first.x; x < end.x; x++)
            least = min(least, texelFetch(answers, ivec3(x, y, open_tiles.tile.y), 0).a);
    tile_class = vec4(least < 0.0 ? TILE_UNDECIDED : TILE_LIT, 0.0, 0.0, 0.0) / 255.0;
}
