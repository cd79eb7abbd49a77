/* The transfer curve of sRGB (IEC 61966-2-1) over [0, 1], in the precision of its users: pictures
 * must not change by the last bit because a table was made in another. */
#pragma once
#include <math.h>

static inline double pen_srgb_decode(double s)
{
    return s <= 0.04045 ? s / 12.92 : pow((s + 0.055) / 1.055, 2.4);
}

static inline double pen_srgb_encode(double l)
{
    return l <= 0.0031308 ? 12.92 * l : 1.055 * pow(l, 1 / 2.4) - 0.055;
}

static inline float pen_srgb_decodef(float s)
{
    return s <= 0.04045f ? s / 12.92f : powf((s + 0.055f) / 1.055f, 2.4f);
}

static inline float pen_srgb_encodef(float l)
{
    return l <= 0.0031308f ? 12.92f * l : 1.055f * powf(l, 1 / 2.4f) - 0.055f;
}
