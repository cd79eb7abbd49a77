// Annen et al. 2008: blocker average and filter, both from prefiltered series.
#include "convolution.glsl"

vec4 visibility(Surface s)
{
    Receiver r = series_receiver(s);
    float nearest_z;
    vec2 extent = min_max_search_extent(r.q, s.p.z, r.metres, nearest_z);
    int kind = receiver_window(r, extent);
    // Loops run zero times where the answer is known: software rasterisers skip nothing else.
    int taps = kind == WINDOW_MIXED ? int(P(search_taps)) : 0;
    float caster_z = blocker_depth(r, extent, taps, nearest_z, s.p.z);
    extent = max(light_filter_extent(caster_z, s.p.z), P(min_filter) * r.metres);
    if (kind == WINDOW_MIXED)
        kind = receiver_window(r, 1.5 * extent);
    taps = kind == WINDOW_MIXED ? int(P(taps)) : 0;
    float v = window_visibility(r, vec2(0.0), extent, taps);
    return scalar_visibility(kind == WINDOW_MIXED ? v : kind == WINDOW_LIT ? 1.0 : 0.0);
}
