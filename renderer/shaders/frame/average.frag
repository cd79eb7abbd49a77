// Mean over the lights of one frame's visibility, weighted for accumulation over frames.
#include "view.glsl"
#include "average.def"
layout(binding = UNIT_SOURCE) uniform sampler2DArray visibility_maps;
layout(location = 0) out vec4 sum;

void main()
{
    sum = vec4(0.0);
    for (int i = 0; i < average.count.x; i++)
        sum += texelFetch(visibility_maps, ivec3(ivec2(gl_FragCoord.xy), i), 0);
    sum = average.count.x == 0 ? vec4(1.0) : sum / float(average.count.x);
    sum *= view.display.w;
}
