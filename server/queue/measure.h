/* What a render is made for: its picture, or figures that compare it with others. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

enum measure {
    MEASURE_PICTURE,   /* the image as the request wants it */
    MEASURE_REFERENCE, /* a PNG and the planes that others are measured against */
    MEASURE_COMPARED,  /* a PNG, then the maps of enum measure_map; result.comparison is filled */
    MEASURE_NUMBERS,   /* nothing but result.comparison */
    MEASURES
};
enum measure_map { MEASURE_MAP_DIFFERENCE, MEASURE_MAP_SSIM, MEASURE_MAP_FLIP, MEASURE_MAPS };

static inline bool measure_has_reference(uint32_t measure)
{
    return measure == MEASURE_COMPARED || measure == MEASURE_NUMBERS;
}
