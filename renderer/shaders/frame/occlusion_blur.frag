// The mean over 4 x 4 texels that lie on about the same surface: one of each turn of the pattern.
layout(binding = UNIT_SOURCE) uniform sampler2D noisy; // of occlusion.frag

layout(location = 0) out vec2 open; // likewise

void main()
{
    ivec2 at = ivec2(gl_FragCoord.xy), last = textureSize(noisy, 0) - 1;
    float depth = texelFetch(noisy, at, 0).g;
    float sum = 0.0, weight = 0.0;
    for (int i = 0; i < 16; i++) {
        vec2 there = texelFetch(noisy, clamp(at + ivec2(i & 3, i >> 2) - 2, ivec2(0), last), 0).rg;
        float w = abs(there.g - depth) < 0.04 * depth ? 1.0 : 1e-4;
        sum += w * there.r;
        weight += w;
    }
    open = vec2(sum / weight, depth);
}
