// The mean over 4 x 4 texels that lie on about the same surface: one of each turn of the pattern.
#include "view.glsl"

layout(binding = UNIT_DEPTH) uniform sampler2D g_depth;
layout(binding = UNIT_SOURCE) uniform sampler2D noisy;

layout(location = 0) out float open;

void main()
{
    ivec2 at = ivec2(gl_FragCoord.xy), size = ivec2(view.viewport.xy),
          last = textureSize(noisy, 0) - 1;
    float depth = texelFetch(g_depth, min(2 * at + 1, size - 1), 0).r;
    float sum = 0.0, weight = 0.0;
    for (int i = 0; i < 16; i++) {
        ivec2 q = clamp(at + ivec2(i & 3, i >> 2) - 2, ivec2(0), last);
        float there = texelFetch(g_depth, min(2 * q + 1, size - 1), 0).r;
        float w = abs(there - depth) < 0.04 * depth ? 1.0 : 1e-4;
        sum += w * texelFetch(noisy, q, 0).r;
        weight += w;
    }
    open = sum / weight;
}
