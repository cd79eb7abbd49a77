#include "horizon.glsl"
layout(binding = 7) uniform sampler2D traced; // rgb: mean of e V, a: mean of V

vec4 visibility(Surface s)
{
    vec4 t = texelFetch(traced, s.pixel, 0);
#if P_weighting == 0
    t /= horizon_weight(horizon_share(s.p, s.n));
#endif
    return clamp(t, 0.0, 1.0);
}
