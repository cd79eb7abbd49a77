// What the pixels see of the light samples of a page: a bit per sample for "lit", one for "dark";
// neither: below the receiver's horizon, or the filter's texels differ. Light pages are numbered as
// in passes/light/light_tree.h; the first has room for two flags.
#include "adaptive_bits.def"
layout(binding = UNIT_BITS) uniform sampler2DArray bits_first;      // pages 0 and 1
layout(binding = UNIT_BITS + 1) uniform sampler2DArray bits_middle; // 2 to 5
layout(binding = UNIT_BITS + 2) uniform sampler2DArray bits_last;   // 6 to 21
const uint FLAG = 0x8000u; // in r: something may block the pixel's light
const uint SAMPLES_OF_FIRST = 0x1ffu;

uvec2 page_bits(ivec2 pixel, int page)
{
    vec2 v = page < 2   ? texelFetch(bits_first, ivec3(pixel, page), 0).rg
             : page < 6 ? texelFetch(bits_middle, ivec3(pixel, page - 2), 0).rg
                        : texelFetch(bits_last, ivec3(pixel, page - 6), 0).rg;
    return uvec2(v * 65535.0 + 0.5);
}
