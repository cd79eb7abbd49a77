// Emission at every point of every pattern of light_bits, averaged over about a point's share.
#include "light.glsl"
layout(binding = UNIT_SOURCE) uniform sampler2D points;
layout(location = 0) out vec4 emission;

void main()
{
    vec2 at = texelFetch(points, ivec2(gl_FragCoord.xy), 0).rg;
    emission = vec4(light_emission(at, 2.0 * inversesqrt(float(textureSize(points, 0).x))), 1.0);
}
