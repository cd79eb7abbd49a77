// Annen et al. 2007: the depth test averaged over a fixed square of the map.
#include "convolution.glsl"

vec4 visibility(Surface s)
{
    Receiver r = series_receiver(s);
    vec2 extent = P(radius) * r.metres;
#ifndef RAW
    // The kernels of the lookups reach over the square's border.
    int kind = receiver_window(r, 1.5 * extent);
    if (kind != WINDOW_MIXED)
        return scalar_visibility(kind == WINDOW_LIT ? 1.0 : 0.0);
#endif
    return scalar_visibility(window_visibility(r, vec2(0.0), extent, int(P(taps))));
}
