// One of 16 phases in [0, 1), each once in every 4 x 4 block of pixels and neighbours far apart
// (Bayer's order); the golden ratio moves all of them from one jittered frame to the next.
float dither(ivec2 pixel, float frame)
{
    int x = pixel.x ^ pixel.y, y = pixel.y;
    int order = (x & 1) << 3 | (y & 1) << 2 | (x & 2) | (y & 2) >> 1;
    return fract((float(order) + 0.5) / 16.0 + 0.61803399 * frame);
}
