// One point as large as a tile per tile of the wanted class; the others are clipped away. A point
// is one square for the rasteriser, where two triangles would shade the blocks on their seam twice.
layout(binding = UNIT_TILES) uniform sampler2D tile_classes;
layout(location = LOCATION_TILE) uniform ivec2 tile; // x: px, y: enum tile_class, the one to draw

void main()
{
    ivec2 count = textureSize(tile_classes, 0);
    ivec2 at = ivec2(gl_VertexID % count.x, gl_VertexID / count.x);
    float found = texelFetch(tile_classes, at, 0).r * 255.0;
    vec2 ndc = (vec2(at) + 0.5) / vec2(count) * vec2(2.0, -2.0) + vec2(-1.0, 1.0);
    gl_Position = abs(found - float(tile.y)) < 0.5 ? vec4(ndc, 0.0, 1.0) : vec4(2.0, 2.0, 2.0, 1.0);
    gl_PointSize = float(tile.x);
}
