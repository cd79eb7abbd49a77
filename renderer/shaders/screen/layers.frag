// One of several jittered frames, which was summed up of layers.
#include "view.glsl"

layout(binding = UNIT_SOURCE) uniform sampler2D sum;

layout(location = 0) out vec4 color;

void main()
{
    color = texelFetch(sum, ivec2(gl_FragCoord.xy), 0) * view.display.w;
}
