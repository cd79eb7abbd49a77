/* Rows of a plane turned into what a file format stores. */
#pragma once
#include "renderer/picture.h"

enum pixels_sample { PIXELS_U8, PIXELS_U16, PIXELS_HALF, PIXELS_FLOAT };

/* IEEE 754 binary16 to float, exactly. */
float pixels_half_to_float(uint16_t half);

/* Writes `channels` samples of each of the `width` pixels of row `y` of `plane` to `out`, with
 * `stride` samples from pixel to pixel. U8 and U16: quantised from [0, 1], native byte order. HALF
 * and FLOAT: floats in both cases, finite, HALF clamped to what a half can hold. A source of RGBA8
 * gives U8 unchanged and n / 255 as a float. */
void pixels_row(const struct pen_plane *plane, uint32_t width, uint32_t y, uint32_t channels,
    enum pixels_sample sample, uint32_t stride, void *out);
