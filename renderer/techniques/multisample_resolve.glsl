#include "horizon.glsl"
layout(binding = UNIT_SOURCE) uniform sampler2D accumulated;

vec4 visibility(Surface s)
{
    vec4 sum = texelFetch(accumulated, s.pixel, 0);
    // A textured light's mean visibility is that of its luminance: there is no fifth channel.
    sum.rgb /= max(sum.a, 1e-20);
    if (P(weighting) == WEIGHTING_AREA)
        sum.rgb *= horizon_fade(horizon_share(s.p, s.n));
    if (light.textured == 0)
        return scalar_visibility(sum.r);
    const vec3 luminance = vec3(0.2126, 0.7152, 0.0722);
    float mean = max(dot(light.emission_mean.rgb, luminance), 1e-6);
    return vec4(sum.rgb, clamp(dot(sum.rgb, luminance) / mean, 0.0, 1.0));
}
