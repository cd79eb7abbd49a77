layout(binding = UNIT_SOURCE) uniform sampler2D darkness;

vec4 visibility(Surface s)
{
    vec4 dark = texelFetch(darkness, s.pixel, 0);
    return clamp(vec4(light.emission_mean.rgb - dark.rgb, 1.0 - dark.a), 0.0,
        max(1.0, max(max(light.emission_mean.r, light.emission_mean.g), light.emission_mean.b)));
}
