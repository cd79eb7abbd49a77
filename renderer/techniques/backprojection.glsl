// Guennebaud, Barthe and Paulin 2006: every map texel is projected back to the emitter's plane,
// clipped against the emitter and its area (or the emission inside) taken away.
#include "caster_patches.glsl"
#include "emitter_area.glsl"
#ifdef TEXTURED
#include "emission_sat.glsl"
#endif

float hidden_share;
vec3 hidden_emission;

void add_patch(vec2 low, vec2 high, float share)
{
    hidden_share += share * emitter_share(low, high);
#ifdef TEXTURED
    hidden_emission += share * emission_inside(low, high);
#endif
}

vec4 visibility(Surface s)
{
    PatchWindow w = patch_window(s);
    hidden_share = 0.0;
    hidden_emission = vec3(0.0);
    walk_patches(w);
    if (w.answer == UMBRA)
        return vec4(0.0);
    float lit = clamp(1.0 - hidden_share / w.above, 0.0, 1.0);
#ifdef TEXTURED
    vec3 hidden = hidden_emission / max(w.above * emission_below(vec2(1.0)), 1e-6);
    return vec4(light.emission_mean.rgb * clamp(1.0 - hidden, 0.0, 1.0), lit);
#else
    return scalar_visibility(lit);
#endif
}
