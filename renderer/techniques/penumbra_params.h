/* Rows of the methods that filter penumbrae on the screen (passes/filter/penumbra.h). */
#pragma once
#include "renderer/techniques/map_params.h"

/* Rows that the blocker search needs, of an aggregate with these fields. */
#define PENUMBRA_ROWS(aggregate, default_taps)                                                     \
    PARAM(aggregate, search_taps, .def = default_taps, .min = 1, .max = 64,                        \
        .help = "Samples used to find the average blocker depth."),                                \
        PARAM(aggregate, min_filter, .def = 1, .min = 0, .max = 16, .unit = "texel",               \
            .help = "Least half width of the penumbra.")
/* Those of the separable Gaussian. */
#define GAUSS_ROWS(aggregate, default_taps, default_sigma)                                         \
    PARAM(aggregate, filter_taps, .def = default_taps, .min = 1, .max = 64,                        \
        .help = "Most taps to each side of a pixel, in each of the two passes."),                  \
        PARAM(aggregate, sigma, .def = default_sigma, .min = 0, .max = 4,                          \
            .help = "Width of the filter over that of the penumbra.")
/* And those of every filter. */
#define FILTER_ROWS(aggregate)                                                                     \
    PARAM(aggregate, max_radius, .def = 128, .min = 1, .max = 1024, .unit = "px",                  \
        .help = "Largest reach of the filter on the screen."),                                     \
        PARAM(aggregate, depth_sigma, .def = 0.01, .min = 0.0001, .max = 1,                        \
            .help = "Distance from the receiver's plane that still counts as the same surface, "   \
                    "as a fraction of the distance to the camera."),                               \
        PARAM(aggregate, normal_power, .def = 32, .min = 1, .max = 256,                            \
            .help = "Sharpness of the filter's preference for equal normals.")
