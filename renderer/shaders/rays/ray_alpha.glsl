// Triangles whose alpha decides. What is computed is what renderer/trace/embree/filter.c computes.
#include "ray_alpha.def"

const uint NO_TEXELS = 0xffffffffu;

float ray_share; // of the ray's light that blended surfaces let through; 1 before it is traced

int alpha_wrap(int i, int size, uint mode)
{
    if (mode == PSC_CLAMP)
        return clamp(i, 0, size - 1);
    int period = mode == PSC_MIRROR ? 2 * size : size;
    i = i < 0 ? period - 1 - (-1 - i) % period : i % period;
    return i < size ? i : period - 1 - i;
}

// Brings a coordinate near the image.
float alpha_reduce(float t, uint mode)
{
    if (mode == PSC_CLAMP)
        return clamp(t, -1.0, 2.0);
    return mode == PSC_MIRROR ? t - 2.0 * floor(0.5 * t) : t - floor(t);
}

float alpha_texel(uint first, ivec2 size, uvec2 wrap, ivec2 at)
{
    uint x = uint(alpha_wrap(at.x, size.x, wrap.x)), y = uint(alpha_wrap(at.y, size.y, wrap.y));
    uint i = first + y * uint(size.x) + x;
    return float(alpha_words[i >> 2u] >> ((i & 3u) * 8u) & 255u);
}

float alpha_sample(uint first, ivec2 size, uint flags, vec2 uv)
{
    uvec2 wrap = uvec2(flags >> WRAP_S_SHIFT, flags >> WRAP_T_SHIFT) & 255u;
    vec2 s = vec2(alpha_reduce(uv.x, wrap.x), alpha_reduce(uv.y, wrap.y)) * vec2(size);
    if ((flags & FLAG_NEAREST) != 0u)
        return alpha_texel(first, size, wrap, ivec2(floor(s))) / 255.0;
    vec2 low = floor(s - 0.5), t = s - 0.5 - low;
    ivec2 i = ivec2(low);
    float top = mix(
        alpha_texel(first, size, wrap, i), alpha_texel(first, size, wrap, i + ivec2(1, 0)), t.x);
    float bottom = mix(alpha_texel(first, size, wrap, i + ivec2(0, 1)),
        alpha_texel(first, size, wrap, i + ivec2(1, 1)), t.x);
    return mix(top, bottom, t.y) / 255.0;
}

bool ray_alpha_hit(uint record, vec2 uv)
{
    AlphaTriangle t = alpha_triangles[record];
    vec3 weight = vec3(1.0 - uv.x - uv.y, uv);
    uint m = WORDS * t.material;
    uint first = alpha_words[m + WORD_FIRST], flags = alpha_words[m + WORD_FLAGS];
    float alpha =
        dot(weight, vec3(t.a[0], t.a[1], t.a[2])) * uintBitsToFloat(alpha_words[m + WORD_FACTOR]);
    float threshold = uintBitsToFloat(alpha_words[m + WORD_CUTOFF]);
    if (first != NO_TEXELS) {
        vec2 s = weight.x * t.uv[0] + weight.y * t.uv[1] + weight.z * t.uv[2];
        ivec2 size = ivec2(alpha_words[m + WORD_WIDTH], alpha_words[m + WORD_HEIGHT]);
        alpha *= alpha_sample(first, size, flags, s);
    }
    if ((flags & FLAG_BLEND) != 0u) {
        ray_share *= 1.0 - clamp(alpha, 0.0, 1.0);
        return ray_share < LEAST_SHARE;
    }
    return alpha >= threshold;
}
