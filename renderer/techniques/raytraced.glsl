#include "horizon.glsl"
#include "raytraced.def"
layout(binding = UNIT_TRACED) uniform sampler2D traced; // rgb: mean of e V, a: mean of V
layout(binding = UNIT_TRACED_ERROR) uniform sampler2D standard_error; // of a

// VARIANCE: instead, the square of the standard error of a.
vec4 visibility(Surface s)
{
#ifdef VARIANCE
    vec4 t = texelFetch(standard_error, s.pixel, 0).rrrr;
#else
    vec4 t = texelFetch(traced, s.pixel, 0);
#endif
#ifndef BY_AREA // which is the method's only weighting
    if (P(weighting) == WEIGHTING_AREA)
#endif
        t /= horizon_weight(horizon_share(s.p, s.n));
    t = clamp(t, 0.0, 1.0);
#ifdef VARIANCE
    t *= t;
#endif
    return t;
}
