// Peters and Klein 2015: the least shadow that four moments allow.
#include "moment_lookup.glsl"

vec4 visibility(Surface s)
{
    MomentLookup l = moment_lookup(s);
    float share = P(moment_bias) > 0.0 ? P(moment_bias) : P(precision) == PRECISION_UNORM16 ? 6e-5 : 6e-7;
    vec4 b = moments_bias(moments_unpack(l.m), share);
    // Rounding leaves shares of up to a thousandth where nothing blocks.
    float shadow = (moment_shadow(b, 2.0 * l.plane.lowest - 1.0) - 0.002) / 0.996;
    float v = 1.0 - clamp(shadow, 0.0, 1.0);
    return scalar_visibility(l.outside ? 1.0 : reduce_bleeding(v, P(bleed)));
}
