// One fragment per tile: may one of its pixels show an edge?
#include "view.glsl"
#include "edge_pixel.glsl"
#include "tile_class.def"
#include "open_tiles.def"

layout(location = 0) out vec4 tile_class; // class / 255

void main()
{
    ivec2 last = ivec2(view.viewport.xy) - 1, first = ivec2(gl_FragCoord.xy) * open_tiles.tile.x;
    ivec2 end = min(first + open_tiles.tile.x, last + 1);
    bool edges = false;
    for (int y = first.y; y < end.y && !edges; y++)
        for (int x = first.x; x < end.x; x++)
            edges = edges || may_show_edge(ivec2(x, y), last);
    tile_class = vec4(edges ? TILE_UNDECIDED : TILE_LIT, 0.0, 0.0, 0.0) / 255.0;
}
