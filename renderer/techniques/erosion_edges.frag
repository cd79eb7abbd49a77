// Edges of the hard shadow buffer, on their shadowed side, where the blocker's depth is known: the
// 3 x 3 Laplacian of the lit bit is positive there.
//   PYRAMID:   level 0 of the min-max pyramid: (W, 1, W) at an edge, else 0
//   otherwise: (which of the neighbours right, left, below, above are lit, as bits; W), and only
//              edges that are silhouettes in the shadow map
#include "view.glsl"
#include "erosion.def"
layout(binding = UNIT_HARD) uniform sampler2D hard_map;
#ifdef PYRAMID
layout(location = 0) out vec4 edge;
#else
layout(location = 0) out vec2 edge;
#endif

float lit_at(ivec2 at)
{
    return texelFetch(hard_map, clamp(at, ivec2(0), ivec2(view.viewport.xy) - 1), 0).x == 1.0 ? 1.0
                                                                                              : 0.0;
}

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 here = texelFetch(hard_map, pixel, 0);
    vec4 lit = vec4(lit_at(pixel + ivec2(1, 0)), lit_at(pixel - ivec2(1, 0)),
        lit_at(pixel + ivec2(0, 1)), lit_at(pixel - ivec2(0, 1)));
    float bits = dot(lit, vec4(1.0, 2.0, 4.0, 8.0));
    bool shadowed = here.x == 0.0 && here.y != 0.0;
#ifdef PYRAMID
    edge = shadowed && bits > 0.0 ? vec4(abs(here.y), 1.0, abs(here.y), 0.0) : vec4(0.0);
#else
    edge = shadowed && here.y > 0.0 ? vec2(bits, here.y) : vec2(0.0);
#endif
}
