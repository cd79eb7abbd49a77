// The mean visibility over the lights, mixed into the one before. SPREAD: of a tile's pixels that
// show a surface, the sum of the squared differences between two of them (r) and their number (g).
#include "progress.def"
layout(binding = UNIT_MEAN_BEFORE) uniform sampler2D mean_before;
layout(location = 0) out vec4 value;

#ifdef SPREAD
layout(binding = UNIT_DEPTH) uniform sampler2D g_depth;
layout(binding = UNIT_MEAN) uniform sampler2D mean_now;

void main()
{
    ivec2 first = ivec2(gl_FragCoord.xy) * PROGRESS_TILE;
    ivec2 end = min(first + PROGRESS_TILE, textureSize(g_depth, 0));
    value = vec4(0.0);
    for (int y = first.y; y < end.y; y++)
        for (int x = first.x; x < end.x; x++) {
            ivec2 at = ivec2(x, y);
            float off = texelFetch(mean_now, at, 0).r - texelFetch(mean_before, at, 0).r;
            if (texelFetch(g_depth, at, 0).r != 0.0)
                value.xy += vec2(off * off, 1.0);
        }
}
#else
layout(binding = UNIT_SOURCE) uniform sampler2DArray visibility_maps;

void main()
{
    ivec2 at = ivec2(gl_FragCoord.xy);
    float sum = 0.0;
    for (int i = 0; i < int(progress.mean.x); i++)
        sum += texelFetch(visibility_maps, ivec3(at, i), 0).a;
    if (progress.mean.x == 0.0)
        sum = 1.0;
    sum *= progress.mean.z;
    // Not mixed where there is none before: what was there may not be a number.
    if (progress.mean.y < 1.0)
        sum = mix(texelFetch(mean_before, at, 0).r, sum, progress.mean.y);
    value = vec4(sum, 0.0, 0.0, 1.0);
}
#endif
