#include "renderer/encode/pixels.h"
#include <float.h>
#include <string.h>

#define HALF_MAX 65504.0f

float pixels_half_to_float(uint16_t half)
{
    uint32_t sign = (uint32_t)(half & 0x8000) << 16, exponent = half >> 10 & 31,
             mantissa = half & 1023;
    union {
        uint32_t bits;
        float value;
    } u;
    if (exponent == 0) { /* zero and subnormals: mantissa * 2^-24 is exact in a float */
        u.value = (float)mantissa * 0x1p-24f;
        u.bits |= sign;
    } else if (exponent == 31) {
        u.bits = sign | 0x7f800000u | mantissa << 13;
    } else {
        u.bits = sign | (exponent + 112) << 23 | mantissa << 13;
    }
    return u.value;
}

static inline float finite_within(float value, float limit)
{
    if (!(value == value))
        return 0;
    return value > limit ? limit : value < -limit ? -limit : value;
}

static inline uint32_t quantise(float value, double scale)
{
    if (!(value > 0)) /* also NaN */
        return 0;
    if (value >= 1)
        return (uint32_t)scale;
    return (uint32_t)(value * scale + 0.5);
}

static inline float load(const struct pen_plane *plane, size_t index)
{
    switch (plane->pixel) {
    case PEN_PIXEL_RGBA8:
        return ((const uint8_t *)plane->data)[index] / 255.0f;
    case PEN_PIXEL_RGBA16F:
        return pixels_half_to_float(((const uint16_t *)plane->data)[index]);
    default:
        return ((const float *)plane->data)[index];
    }
}

void pixels_row(const struct pen_plane *plane, uint32_t width, uint32_t y, uint32_t channels,
    enum pixels_sample sample, uint32_t stride, void *out)
{
    size_t first = (size_t)y * width * 4;
    if (plane->pixel == PEN_PIXEL_RGBA8 && sample == PIXELS_U8) {
        const uint8_t *in = (const uint8_t *)plane->data + first;
        uint8_t *bytes = out;
        if (channels == 4 && stride == 4) {
            memcpy(bytes, in, (size_t)width * 4);
        } else if (channels == 3 && stride == 3) {
            for (uint32_t x = 0; x < width; x++, in += 4, bytes += 3) {
                bytes[0] = in[0];
                bytes[1] = in[1];
                bytes[2] = in[2];
            }
        } else {
            for (uint32_t x = 0; x < width; x++)
                for (uint32_t c = 0; c < channels; c++)
                    bytes[(size_t)x * stride + c] = in[(size_t)x * 4 + c];
        }
        return;
    }
    for (uint32_t x = 0; x < width; x++) {
        for (uint32_t c = 0; c < channels; c++) {
            float value = load(plane, first + (size_t)x * 4 + c);
            size_t to = (size_t)x * stride + c;
            if (sample == PIXELS_U8)
                ((uint8_t *)out)[to] = (uint8_t)quantise(value, 255);
            else if (sample == PIXELS_U16)
                ((uint16_t *)out)[to] = (uint16_t)quantise(value, 65535);
            else
                ((float *)out)[to] =
                    finite_within(value, sample == PIXELS_HALF ? HALF_MAX : FLT_MAX);
        }
    }
}
