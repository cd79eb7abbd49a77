// Integral of emission over rectangles of the emitter, divided by its area
// (passes/light/emission_sat.h).
layout(binding = UNIT_EMISSION_SUMS) uniform sampler2D emission_sums;

vec3 emission_below(vec2 corner)
{
    vec2 at = (0.5 * clamp(corner, -1.0, 1.0) + 0.5) * 128.0 + 0.5;
    return textureLod(emission_sums, at / 129.0, 0.0).rgb;
}

vec3 emission_inside(vec2 low, vec2 high)
{
    return emission_below(high) - emission_below(vec2(low.x, high.y)) -
           emission_below(vec2(high.x, low.y)) + emission_below(low);
}
