// Counts, per pixel, the lights and frames in which the classifier proved it lit (x) or in umbra
// (y): of a cube's faces, the one that owns the whole tile. The background sees every light. TILES:
// the method was classified.
#include "classes.def"
layout(binding = UNIT_DEPTH) uniform sampler2D g_depth;
layout(binding = UNIT_TILES) uniform sampler2D tile_classes; // class / 255
layout(location = 0) out vec4 proved;

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float found = TILE_UNDECIDED;
#ifdef TILES
    found = texelFetch(tile_classes, pixel / classes.tile.x, 0).r * 255.0;
#endif
    if (texelFetch(g_depth, pixel, 0).r == 0.0)
        found = classes.tile.y != 0 ? TILE_LIT : TILE_UNDECIDED;
    proved = vec4(abs(found - TILE_LIT) < 0.5, abs(found - TILE_UMBRA) < 0.5, 0.0, 0.0);
}
