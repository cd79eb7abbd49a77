// Corner sums of emission, ROWS first, then columns of the row sums.
#include "light.glsl"
#include "emitter_area.glsl"
layout(binding = UNIT_SOURCE) uniform sampler2D rows;
layout(location = 0) out vec4 sum;

void main()
{
    ivec2 at = ivec2(gl_FragCoord.xy);
    sum = vec4(0.0);
#ifdef ROWS
    float cell = 2.0 / 128.0;
    for (int x = 0; x < at.x; x++) {
        vec2 low = vec2(x, at.y) * cell - 1.0;
        sum.rgb += light_emission(low + 0.5 * cell, cell) * emitter_share(low, low + cell);
    }
#else
    for (int y = 0; y < at.y; y++)
        sum += texelFetch(rows, ivec2(at.x, y), 0);
#endif
}
