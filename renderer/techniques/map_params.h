/* Rows that every method with a single shadow map has, written once. */
#pragma once
#include "protocol/param.h"

#define MAP_SIZE_ROW(aggregate, default_size)                                                      \
    PARAM(aggregate, map_size, .def = default_size, .min = 64, .max = 8192, .unit = "texel",       \
        .help = "Side of the shadow map.")
/* The receiver's plane is compared exactly, so the bias only covers rounding and facets. */
#define BIAS_ROW(aggregate)                                                                        \
    PARAM(aggregate, bias, .def = 0.0005, .min = 0, .max = 0.1,                                    \
        .help = "Depth bias as a fraction of the distance to the light.")
/* The end of the artefacts of all methods that look depths up in maps. */
#define BLENDED_GRAIN                                                                              \
    " Of blended casters a share of the map's texels blocks, which is right in the mean and "      \
    "shows as "                                                                                    \
    "grain where the filter is narrow."
/* Of methods whose filter lets light through; a pen_flag. */
#define BOUNDED_ROW(aggregate)                                                                     \
    PARAM(aggregate, bounded, .def = 1,                                                            \
        .help = "Keeps dark what the exact depths prove to be; off: the filter as published.")
