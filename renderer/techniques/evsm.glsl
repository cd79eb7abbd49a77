// Lauritzen's EVSM4: Chebyshev's bound on depth warped by a convex and by a concave exponential.
// The mean of a warped slope is not below the warp of its centre in the convex one; in the concave
// one it is by a factor of cosh(c r) at most, r being half the slope's depth range, ln cosh x <=
// x^2 / 2.
#include "moment_lookup.glsl"

vec4 visibility(Surface s)
{
    MomentLookup l = moment_lookup(s);
    vec2 exponents = vec2(P(positive_exponent), P(negative_exponent));
    float r = 2.0 * max(l.plane.highest - l.plane.mean, l.plane.mean - l.plane.lowest);
    float back = 0.25 * exponents.y * r * r; // in unit depth
    float concave = max(l.plane.mean - back, l.plane.lowest);
    if (l.plane.clamped)
        concave = l.plane.lowest;
    vec2 t = vec2(exponential_warp(2.0 * l.plane.mean - 1.0, exponents).x,
        exponential_warp(2.0 * concave - 1.0, exponents).y);
    vec2 least = P(min_deviation) * exponents * t;
    least *= least;
    float v = min(chebyshev(l.m.xz, t.x, least.x), chebyshev(l.m.yw, t.y, least.y));
    return scalar_visibility(l.outside ? 1.0 : reduce_bleeding(v, P(bleed)));
}
