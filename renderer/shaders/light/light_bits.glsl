// Occlusion bits of the emitter's points (passes/light/light_bits.h). LIGHT_BITS, an expression, is
// 64 or 256; patches that overlap set the same bits, so casters behind one another count once.
#include "patches.def"
// (step, 2 pattern + axis, 128 bits)
layout(binding = UNIT_LIGHT_BITS) uniform usampler2DArray bits_below;
#define BIT_LAYERS (LIGHT_BITS == 256 ? 2 : 1)
const float BIT_STEPS = 512.0;

uvec4 hidden_bits[2]; // 64: xy of the first
int bit_pattern;

void bits_begin(int pattern)
{
    bit_pattern = pattern;
    for (int i = 0; i < BIT_LAYERS; i++)
        hidden_bits[i] = uvec4(0u);
}

void bits_add(vec2 low, vec2 high)
{
    ivec4 at = ivec4(clamp(vec4(low, high) * 0.5 + 0.5, 0.0, 1.0) * BIT_STEPS + 0.5);
    int row = 2 * bit_pattern;
    for (int i = 0; i < BIT_LAYERS; i++)
        hidden_bits[i] |= texelFetch(bits_below, ivec3(at.z, row, i), 0) &
                          ~texelFetch(bits_below, ivec3(at.x, row, i), 0) &
                          texelFetch(bits_below, ivec3(at.w, row + 1, i), 0) &
                          ~texelFetch(bits_below, ivec3(at.y, row + 1, i), 0);
}

float bits_lit_share()
{
    int count = 0;
    for (int i = 0; i < BIT_LAYERS; i++) {
        ivec4 n = bitCount(hidden_bits[i]);
        count += n.x + n.y + n.z + n.w;
    }
    return 1.0 - float(count) * (1.0 / float(LIGHT_BITS));
}
