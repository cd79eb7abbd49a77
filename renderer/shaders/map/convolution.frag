// Two terms of the caster part of the series, per texel of the depth map. WEIGHTED: times depth.
#include "light.glsl"
#include "basis.def"
layout(binding = UNIT_SOURCE) uniform sampler2D source;
#ifdef TABLES
layout(location = 0) out uvec4 value;
#define STORED(v) uvec4(clamp(v, 0.0, 1.0) / basis.table_scale + 0.5)
#else
layout(location = 0) out vec4 value;
#define STORED(v) (v)
#endif

void main()
{
    float d = texelFetch(source, ivec2(gl_FragCoord.xy), 0).r;
    float z = (light_linear(d) - light.near_z) / (light.far_z - light.near_z) * basis.range;
    if (basis.first_term < 0) {
        value = STORED(vec4(z, 0.0, 0.0, 0.0));
        return;
    }
    float c = 3.14159265 * float(2 * basis.first_term + 1) * z, step = 6.28318531 * z;
    vec4 v = vec4(sin(c), cos(c), sin(c + step), cos(c + step));
    if (basis.first_term + 1 >= basis.terms)
        v.zw = vec2(0.0);
#ifdef WEIGHTED
    v *= z;
#endif
    value = STORED(0.5 * v + 0.5);
}
