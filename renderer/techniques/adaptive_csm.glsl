// The estimator of adaptive.glsl as published: convolution shadow maps.
#include "adaptive.glsl"
#include "convolution.glsl"

// Cells of the series: lookups at the same places at every level, so that levels agree.
Receiver adaptive_receiver(Surface s)
{
    return series_receiver(s);
}

int adaptive_window(Receiver r, vec2 extent)
{
    return receiver_window(r, extent);
}

float adaptive_blocker_depth(
    Receiver r, vec2 extent, vec2 shift, bool wanted, float nearest_z, float receiver_z)
{
    return blocker_depth(r, extent, wanted ? int(P(search_taps)) : 0, nearest_z, receiver_z);
}

float estimate(Receiver r, vec2 offset, vec2 extent, vec2 shift, int level)
{
    return window_visibility(r, offset, extent, max(int(P(taps)) >> level, 1));
}
