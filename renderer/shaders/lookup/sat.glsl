// Means of windows from a modular summed-area table (passes/map/sat.c).
#include "sat.def"
// Texel (x, y): sum over [0, x) x [0, y), mod 2^32.
layout(binding = UNIT_SAT) uniform usampler2D sat;

vec2 sat_texel() // m on the map plane
{
    return (light.rect.zw - light.rect.xy) / sat_info.side;
}

uvec4 sat_at(int x, int y)
{
    return texelFetch(sat, ivec2(x, y), 0);
}

// Mean over [low, high), whole texels.
vec4 sat_mean_whole(ivec2 low, ivec2 high)
{
    uvec4 sum = sat_at(high.x, high.y) - sat_at(low.x, high.y) - sat_at(high.x, low.y) +
                sat_at(low.x, low.y);
    ivec2 size = high - low;
    return vec4(sum) * (sat_info.inverse_scale / float(size.x * size.y));
}

// Mean over [low, high] in texels, 0 <= low < high <= side; texels that the border cuts count by
// the part that lies inside. 16 loads: sums to fractional corners are bilinear in those to whole
// ones, and are taken relative to one corner while they are integers.
vec4 sat_mean(vec2 low, vec2 high)
{
    int last = int(sat_info.side);
    ivec2 a = ivec2(low), b = ivec2(high);
    vec2 fa = low - vec2(a), fb = high - vec2(b);
    int xs[4] = int[4](a.x, min(a.x + 1, last), b.x, min(b.x + 1, last));
    int ys[4] = int[4](a.y, min(a.y + 1, last), b.y, min(b.y + 1, last));
    vec4 wx = vec4(fa.x - 1.0, -fa.x, 1.0 - fb.x, fb.x);
    vec4 wy = vec4(fa.y - 1.0, -fa.y, 1.0 - fb.y, fb.y);
    uvec4 base[4];
    for (int i = 0; i < 4; i++)
        base[i] = sat_at(xs[i], ys[0]);
    vec4 sum = vec4(0.0);
    for (int j = 1; j < 4; j++) {
        uvec4 first = sat_at(xs[0], ys[j]) - base[0];
        vec4 row = vec4(0.0);
        for (int i = 1; i < 4; i++)
            row += wx[i] * vec4(sat_at(xs[i], ys[j]) - base[i] - first);
        sum += wy[j] * row;
    }
    vec2 size = high - low;
    return sum * (sat_info.inverse_scale / (size.x * size.y));
}
