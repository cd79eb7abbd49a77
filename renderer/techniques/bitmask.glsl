// Schwarz and Stamminger 2007: as backprojection, but each map texel sets the bits of the emitter's
// points that it hides, so that overlapping casters count once.
#include "caster_patches.glsl"
#define LIGHT_BITS (P(samples) == SAMPLES_64 ? 64 : 256)
#include "light_bits.glsl"
#ifdef TEXTURED
layout(binding = UNIT_BIT_EMISSION) uniform sampler2D bit_emission; // (point, pattern)
#endif

void add_patch(vec2 low, vec2 high, float share)
{
    // Part of a coarse texel: a smaller rectangle of that area.
    vec2 cut = 0.5 * (high - low) * (1.0 - sqrt(share));
    bits_add(low + cut, high - cut);
}

#ifdef TEXTURED
// Share of each channel's emission that comes from points that are hidden.
vec3 emission_hidden_share(int pattern)
{
    vec3 hidden = vec3(0.0), all = vec3(0.0);
    for (int i = 0; i < LIGHT_BITS; i++) {
        uint word = hidden_bits[i >> 7][i >> 5 & 3];
        vec3 e = texelFetch(bit_emission, ivec2(i, pattern), 0).rgb;
        all += e;
        hidden += (word >> (i & 31) & 1u) != 0u ? e : vec3(0.0);
    }
    return hidden / max(all, 1e-6);
}
#endif

vec4 visibility(Surface s)
{
    PatchWindow w = patch_window(s);
    int pattern = 0;
    if (P(pattern) == PATTERN_JITTERED) {
        // Jittered frames of an anti-aliased image take other sets.
        int pixel = (s.pixel.x & 3) | (s.pixel.y & 3) << 2;
        pattern = pixel + 5 * int(view.display.z) & 15;
    }
    bits_begin(pattern);
    walk_patches(w);
    float hidden = w.answer == UMBRA ? 1.0 : (1.0 - bits_lit_share()) / w.above;
    float lit = max(1.0 - hidden, 0.0);
#ifdef INTERLEAVED
    // Width on the screen, F5, of the sharpest shadow here, for the averaging pass.
    float scale = light_parallel ? 1.0 : s.p.z / light.near_z;
    float width = 2.0 * w.reach.x * min(w.narrowest / w.widest, 1.0);
    float pixels = width * scale * view.eye.w * s.depth / view.forward.w;
    return vec4(lit, lit < 1.0 ? pixels : 0.0, 0.0, 1.0);
#elif defined(TEXTURED)
    if (lit == 0.0 || lit == 1.0)
        return scalar_visibility(lit);
    vec3 lit_emission = max(1.0 - emission_hidden_share(pattern) / w.above, 0.0);
    return vec4(light.emission_mean.rgb * lit_emission, lit);
#else
    return scalar_visibility(lit);
#endif
}
