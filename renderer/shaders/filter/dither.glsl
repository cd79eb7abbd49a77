// One of 16 phases per pixel, each once in every 4 x 4 block and neighbours far apart (Bayer's
// order). Irrational steps move all of them from one jittered frame to the next.
#include "sequences.glsl"

int dither_order(ivec2 pixel)
{
    int x = pixel.x ^ pixel.y, y = pixel.y;
    return (x & 1) << 3 | (y & 1) << 2 | (x & 2) | (y & 2) >> 1;
}

float dither(ivec2 pixel, float frame)
{
    return fract((float(dither_order(pixel)) + 0.5) / 16.0 + 0.61803399 * frame);
}

// The 16 points of a Hammersley set.
vec2 dither2(ivec2 pixel, float frame)
{
    return fract(hammersley16(dither_order(pixel)) + frame * R2_STEP);
}
