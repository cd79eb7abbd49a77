// Counts, per pixel, the lights and frames in which the classifier proved it lit (x) or in umbra (y):
// of a cube's faces, the one that owns the whole tile. The background sees every light. TILES: the
// method was classified.
layout(binding = 0) uniform sampler2D g_depth;
layout(binding = 15) uniform sampler2D tile_classes; // class / 255
layout(std140, binding = 3) uniform ClassesBlock {
    ivec4 tile; // x: px, y: 1 when the background counts
} classes;
layout(location = 0) out vec4 proved;

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float found = 1.0;
#ifdef TILES
    found = texelFetch(tile_classes, pixel / classes.tile.x, 0).r * 255.0;
#endif
    if (texelFetch(g_depth, pixel, 0).r == 0.0)
        found = classes.tile.y != 0 ? 0.0 : 1.0;
    proved = vec4(found < 0.5 ? 1.0 : 0.0, abs(found - 2.0) < 0.5 ? 1.0 : 0.0, 0.0, 0.0);
}
