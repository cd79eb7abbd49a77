// What the pixels have of this frame and those before, and what some have caught up from kept maps.
#include "temporal.def"
layout(binding = UNIT_FRESH) uniform sampler2D more;
layout(binding = UNIT_LAST_MEAN) uniform sampler2D means;
layout(binding = UNIT_LAST_STATE) uniform sampler2D states;
layout(location = 0) out vec4 mean;

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 caught = texelFetch(more, pixel, 0);
    mean = texelFetch(means, pixel, 0);
    if (caught.a <= 0.0)
        return;
    float samples = texelFetch(states, pixel, 0).x;
    mean = (samples * mean + temporal.fresh.y * caught) / (samples + temporal.fresh.x);
}
