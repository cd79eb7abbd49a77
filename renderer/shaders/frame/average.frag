// Mean over the lights of one frame's visibility, weighted for accumulation over frames. The
// background sees every light, also in tiles that were filled as a whole.
#include "view.glsl"
#include "average.def"
layout(binding = UNIT_DEPTH) uniform sampler2D g_depth;
layout(binding = UNIT_SOURCE) uniform sampler2DArray visibility_maps;
layout(location = 0) out vec4 sum;

void main()
{
    sum = vec4(0.0);
    for (int i = 0; i < average.count.x; i++)
        sum += texelFetch(visibility_maps, ivec3(ivec2(gl_FragCoord.xy), i), 0);
    bool lit = average.count.x == 0 || texelFetch(g_depth, ivec2(gl_FragCoord.xy), 0).r == 0.0;
    sum = lit ? vec4(1.0) : sum / float(average.count.x);
    sum *= view.display.w;
}
