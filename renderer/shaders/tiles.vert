// One quad per tile of the wanted class; the others collapse to nothing.
#include "view.glsl"
layout(binding = 15) uniform sampler2D tile_classes;
uniform ivec2 tile; // x: px, y: class to draw

void main()
{
    ivec2 count = textureSize(tile_classes, 0);
    ivec2 at = ivec2(gl_InstanceID % count.x, gl_InstanceID / count.x);
    float found = texelFetch(tile_classes, at, 0).r * 255.0;
    vec2 corner = vec2(at * tile.x + ivec2(gl_VertexID & 1, gl_VertexID >> 1) * tile.x);
    corner = min(corner, view.viewport.xy);
    vec2 ndc = corner * view.viewport.zw * vec2(2.0, -2.0) + vec2(-1.0, 1.0);
    gl_Position = abs(found - float(tile.y)) < 0.5 ? vec4(ndc, 0.0, 1.0) : vec4(2.0, 2.0, 2.0, 1.0);
}
