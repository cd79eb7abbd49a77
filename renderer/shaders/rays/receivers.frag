// World position and geometric normal of every pixel, for work outside of OpenGL. Background: 0.
#include "view.glsl"
#include "octahedral.glsl"
layout(binding = UNIT_DEPTH) uniform sampler2D g_depth;
layout(binding = UNIT_NORMAL) uniform sampler2D g_normal;
layout(location = 0) out vec4 position;
layout(location = 1) out vec4 normal;

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float depth = texelFetch(g_depth, pixel, 0).r;
    bool hit = depth != 0.0;
    vec3 n = octahedral_decode(texelFetch(g_normal, pixel, 0).xy);
    position =
        hit ? vec4(unproject(view.clip_to_world, pixel_to_ndc(pixel), depth), 1.0) : vec4(0.0);
    normal = hit ? vec4(n, 0.0) : vec4(0.0);
}
