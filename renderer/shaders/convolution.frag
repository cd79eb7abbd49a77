// Two terms of the caster part of the series, per texel of the depth map. WEIGHTED: times depth.
#include "light.glsl"
layout(binding = 7) uniform sampler2D source;
layout(std140, binding = 3) uniform BasisBlock {
    float range;
    int first_term; // from 0; -1: depth itself
    int terms;
    int pad;
} basis;
layout(location = 0) out vec4 value;

void main()
{
    float d = texelFetch(source, ivec2(gl_FragCoord.xy), 0).r;
    float z = (light_linear(d) - light.near_z) / (light.far_z - light.near_z) * basis.range;
    if (basis.first_term < 0) {
        value = vec4(z, 0.0, 0.0, 0.0);
        return;
    }
    float c = 3.14159265 * float(2 * basis.first_term + 1) * z, step = 6.28318531 * z;
    vec4 v = vec4(sin(c), cos(c), sin(c + step), cos(c + step));
    if (basis.first_term + 1 >= basis.terms)
        v.zw = vec2(0.0);
#ifdef WEIGHTED
    v *= z;
#endif
    value = 0.5 * v + 0.5;
}
