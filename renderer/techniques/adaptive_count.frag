// Counts, per quad of the light's tree, the pixels whose samples at its corners disagree: into
// counters, or by the fragments that remain (QUERY: one quad a pass).
#include "adaptive_bits.glsl"
#include "adaptive_count.def"
#ifndef QUERY
#include "adaptive_counters.def"
#endif

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    uvec2 words[6], any_bits = uvec2(0u);
    for (int page = 0; page < 6; page++)
        words[page] = uvec2(0u);
    for (int page = 0; page < quads.count.y; page++) {
        words[page] = page_bits(pixel, page);
        any_bits |= page == 0 ? words[0] & SAMPLES_OF_FIRST : words[page];
    }
    bool forced = quads.count.z != 0 && (words[0].x & FLAG) != 0u;
    bool mixed = any_bits.x != 0u && any_bits.y != 0u;
    int n = forced || mixed ? quads.count.x : 0;
    bool counted = false;
    for (int i = 0; i < n; i++) {
        uvec2 corners = uvec2(0u);
        for (int k = 0; k < 4; k++) {
            uint place = quads.corners[i][k];
            corners |= words[place >> 4] >> (place & 15u) & 1u;
        }
        if (forced || (corners.x & corners.y) != 0u) {
            counted = true;
#ifndef QUERY
            atomicAdd(disagreeing[i], 1u);
#endif
        }
    }
#ifdef QUERY
    if (!counted)
        discard;
#endif
}
