// Lauritzen's EVSM4: Chebyshev's bound on depth warped by a convex and by a concave exponential. The
// warps bend a sloped plane, so it is compared at its nearest point in the kernel.
#include "moment_lookup.glsl"

vec4 visibility(Surface s)
{
    MomentLookup l = moment_lookup(s);
    vec2 exponents = vec2(P(positive_exponent), P(negative_exponent));
    vec2 t = exponential_warp(2.0 * l.plane.lowest - 1.0, exponents);
    vec2 least = P(min_deviation) * exponents * t;
    least *= least;
    float v = min(chebyshev(l.m.xz, t.x, least.x), chebyshev(l.m.yw, t.y, least.y));
    return scalar_visibility(l.outside ? 1.0 : reduce_bleeding(v, P(bleed)));
}
