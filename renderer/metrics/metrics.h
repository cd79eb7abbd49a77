/* How far a picture is from a reference. No GL; all sums in double precision. */
#pragma once
#include "protocol/error.h"

/* Rows top first, `stride` floats from one pixel to the next; `data` points at
 * the first channel. */
struct pen_metrics_image {
    const float *data;
    uint32_t width, height, stride;
};

/* Root of the mean square difference over all pixels and the first `channels` channels. */
bool pen_metrics_rmse(const struct pen_metrics_image *test,
    const struct pen_metrics_image *reference, uint32_t channels, double *rmse,
    struct pen_error *error);

/* Of one channel that holds a mean visibility. */
struct pen_metrics_visibility {
    double rmse;          /* all pixels */
    double penumbra_rmse; /* pixels with 0.02 < reference < 0.98; 0 when there are none */
    double mean_error;    /* of test - reference, all pixels */
    double largest;       /* absolute difference */
    uint64_t penumbra_pixels;
};
bool pen_metrics_visibility(const struct pen_metrics_image *test,
    const struct pen_metrics_image *reference, struct pen_metrics_visibility *out,
    struct pen_error *error);

/* Structural similarity (Wang et al. 2004) of the luma 0.299 r + 0.587 g + 0.114 b of
 * display-encoded RGB in [0,1]: Gaussian window 11 x 11, sigma 1.5, K1 0.01, K2 0.03, range 1.
 * `map`, when not NULL: width * height values in [-1,1]. At a pixel whose window leaves the picture
 * the window is cut and its weights scaled to sum to 1. Such pixels do not enter the means, unless no
 * window fits at all (a side below 11); so the mean is what the authors' own program gives. */
struct pen_metrics_similarity {
    double mean;     /* 1: equal */
    double contrast; /* the mean of SSIM's second factor, of the standard deviations alone */
};
bool pen_metrics_ssim(const struct pen_metrics_image *test,
    const struct pen_metrics_image *reference, float *map, struct pen_metrics_similarity *out,
    struct pen_error *error);

/* What a viewer sees when flipping between the two pictures: LDR-FLIP (Andersson et al. 2020) of
 * display-encoded sRGB (clamped to [0,1]), 0 equal to 1. `pixels_per_degree`: of the viewer's eye;
 * 4 to 1000, 0: 67, a 0.7 m wide display of 3840 pixels seen from 0.7 m. Edge pixels are repeated
 * outwards. `map`, when not NULL: width * height values; *mean is its mean. */
bool pen_metrics_flip(const struct pen_metrics_image *test,
    const struct pen_metrics_image *reference, double pixels_per_degree, float *map, double *mean,
    struct pen_error *error);
