// The integers that a summed-area table is made of: mean moments of the map texels under one texel
// of the table, times the scale.
#include "depth_unit.glsl"
#include "moments.glsl"
#include "sat_moments.def"
layout(binding = UNIT_SOURCE) uniform sampler2D source; // hardware depth
layout(location = 0) out uvec4 result;

void main()
{
    int step = int(table.scale.y);
    ivec2 base = ivec2(gl_FragCoord.xy) * step;
    vec4 sum = vec4(0.0);
    for (int y = 0; y < step; y++)
        for (int x = 0; x < step; x++) {
            float u = depth_unit(texelFetch(source, base + ivec2(x, y), 0).r);
#ifdef FOUR
            float z = 2.0 * u - 1.0, z2 = z * z;
            sum += vec4(z, z2, z2 * z, z2 * z2);
#else
            sum += vec4(u, u * u, 0.0, 0.0);
#endif
        }
    sum /= float(step * step);
#ifdef FOUR
    sum = moments_pack(sum);
#endif
    result = uvec4(clamp(sum, 0.0, 1.0) * table.scale.x + 0.5);
}
