// Peters and Klein 2015: the least shadow that four moments allow.
#include "moment_lookup.glsl"

vec4 visibility(Surface s)
{
    MomentLookup l = moment_lookup(s);
    float share = P(moment_bias) > 0.0                ? P(moment_bias)
                  : P(precision) == PRECISION_UNORM16 ? 6e-5
                                                      : 6e-7;
    vec4 b = moments_bias(moments_unpack(l.m), share);
    // A lit slope spreads over [lowest, highest] but has its centre as the mean: only when the mean
    // is less does something block, and then the centre is the better depth to compare with.
    float below = (l.plane.mean - 0.5 - 0.5 * b.x) / max(l.plane.mean - l.plane.lowest, 1e-6);
    float depth = mix(l.plane.lowest, l.plane.mean, clamp(4.0 * below, 0.0, 1.0));
    // Rounding leaves shares of up to a thousandth where nothing blocks.
    float shadow = (moment_shadow(b, 2.0 * depth - 1.0) - 0.002) / 0.996;
    float v = 1.0 - clamp(shadow, 0.0, 1.0);
    return scalar_visibility(l.outside ? 1.0 : reduce_bleeding(v, P(bleed)));
}
