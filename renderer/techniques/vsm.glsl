// Donnelly and Lauritzen 2006. A lit plane has its own depth as the mean, whatever its slope.
#include "moment_lookup.glsl"

vec4 visibility(Surface s)
{
    MomentLookup l = moment_lookup(s);
    float v = chebyshev(l.m.xy, l.plane.mean, P(min_variance));
    return scalar_visibility(l.outside ? 1.0 : reduce_bleeding(v, P(bleed)));
}
