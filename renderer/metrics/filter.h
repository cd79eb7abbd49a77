/* What the metrics share. */
#pragma once
#include "renderer/metrics/metrics.h"

/* A row of weights for offsets -radius .. radius. */
struct metrics_kernel {
    double *weights; /* at offset 0 */
    int radius;
};

enum metrics_border {
    METRICS_REPEAT, /* pixels beyond the border equal the nearest inside */
    METRICS_CUT,    /* they are left out, and the rest of the weights scaled up */
};

/* out = image filtered with x's weights along rows and y's along columns. `scratch` and out hold
 * width * height; out may be the image itself. */
void metrics_filter(const double *image, uint32_t width, uint32_t height,
    const struct metrics_kernel *x, const struct metrics_kernel *y, enum metrics_border border,
    double *scratch, double *out);

/* False with *error filled unless both pictures have the same, non-zero size. */
bool metrics_check(const struct pen_metrics_image *test, const struct pen_metrics_image *reference,
    uint32_t channels, struct pen_error *error);
