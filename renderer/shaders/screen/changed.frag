// One fragment per tile of 8 x 8 pixels: a sum over its visibilities, which is another one for any
// others but for a chance of 2^-64. AGAIN: whether it is the one before.
#include "tile_class.def"
layout(binding = UNIT_SOURCE) uniform sampler2DArray visibility_maps;
#ifdef AGAIN
layout(binding = UNIT_BEFORE) uniform sampler2D tiles_before;
#endif

// Class / 255; the sum's bits, as whole numbers that a float holds.
layout(location = 0) out vec4 tile;

// A round of MurmurHash3 (A. Appleby, 2011).
uint mix_in(uint sum, uint value)
{
    value *= 0xcc9e2d51u;
    value = (value << 15 | value >> 17) * 0x1b873593u;
    sum ^= value;
    return (sum << 13 | sum >> 19) * 5u + 0xe6546b64u;
}

void main()
{
    ivec3 size = textureSize(visibility_maps, 0);
    ivec2 first = ivec2(gl_FragCoord.xy) * 8, end = min(first + 8, size.xy);
    uvec2 sum = uvec2(0u, 0x9e3779b9u);
    for (int layer = 0; layer < size.z; layer++)
        for (int y = first.y; y < end.y; y++)
            for (int x = first.x; x < end.x; x++) {
                vec4 seen = texelFetch(visibility_maps, ivec3(x, y, layer), 0);
                uvec2 bits = uvec2(packHalf2x16(seen.rg), packHalf2x16(seen.ba));
                sum.x = mix_in(mix_in(sum.x, bits.x), bits.y);
                sum.y = mix_in(mix_in(sum.y, bits.y), bits.x + 1u);
            }
    tile = vec4(0.0, sum & 0xffffffu, (sum.x >> 24) + (sum.y >> 24) * 256u);
    int kind = TILE_UNDECIDED;
#ifdef AGAIN
    if (texelFetch(tiles_before, ivec2(gl_FragCoord.xy), 0).yzw == tile.yzw)
        kind = TILE_LIT;
#endif
    tile.x = float(kind) / 255.0;
}
