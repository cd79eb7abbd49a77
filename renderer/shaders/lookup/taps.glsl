// Sampling patterns of kernels over the emitter's shape, points in [-1, 1]^2. A pattern is walked
// by adding a constant, so that a tap costs no trigonometry.
//
// Rectangle: the R2 sequence. Disk: Vogel's spiral (1979), equal area per tap.
#include "sequences.glsl"

struct Taps {
    vec2 at; // R2 state in [0, 1)^2, or unit direction of the spiral
    float index, inverse_count;
};

// `shift` in [0, 1)^2 moves the whole pattern (Cranley and Patterson 1976).
Taps taps_begin(int count, vec2 shift)
{
    Taps t;
    t.index = shift.y;
    t.inverse_count = 1.0 / float(count);
    if (light_shape == SHAPE_DISK) {
        float angle = 6.2831853 * shift.x;
        t.at = vec2(cos(angle), sin(angle));
    } else {
        t.at = shift;
    }
    return t;
}

vec2 taps_next(inout Taps t)
{
    vec2 p;
    if (light_shape == SHAPE_DISK) {
        p = t.at * sqrt(t.index * t.inverse_count);
        t.at = mat2(-0.73736888, 0.67549029, -0.67549029, -0.73736888) * t.at; // golden angle
    } else {
        p = 2.0 * t.at - 1.0;
        t.at = fract(t.at + R2_STEP);
    }
    t.index += 1.0;
    return p;
}

// One of 16 shifts, a different one for each pixel of every 4 x 4 block (Keller and Heidrich 2001):
// the Hammersley set of 16 points. Multiples of the R2 step would not do: a pattern shifted by them
// is the same sequence further on, and 16 of those overlap almost entirely.
vec2 interleaved_shift(ivec2 pixel)
{
    // Bits of x and y interleaved, so that neighbours are far apart in the set.
    return hammersley16(
        (pixel.x & 1) << 3 | (pixel.y & 1) << 2 | (pixel.x & 2) | (pixel.y & 2) >> 1);
}

// Frame number folded in, so that jittered frames average different patterns.
vec2 frame_shift(ivec2 pixel)
{
    return fract(interleaved_shift(pixel) + view.display.z * vec2(0.38196601, 0.27639320));
}
