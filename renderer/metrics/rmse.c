/* Errors of numbers. */
#include "renderer/metrics/filter.h"
#include <math.h>
#include <stddef.h>

#define MAX_SIDE 65536u

bool metrics_check(const struct pen_metrics_image *test, const struct pen_metrics_image *reference,
    uint32_t channels, struct pen_error *error)
{
    if (test->width != reference->width || test->height != reference->height)
        return pen_fail(error, PEN_INVALID, "", "The pictures differ in size: %u x %u and %u x %u.",
            test->width, test->height, reference->width, reference->height);
    if (test->width == 0 || test->height == 0 || test->width > MAX_SIDE || test->height > MAX_SIDE)
        return pen_fail(error, PEN_INVALID, "", "The pictures have no or too many pixels.");
    if (channels == 0 || test->stride < channels || reference->stride < channels)
        return pen_fail(error, PEN_INVALID, "", "The pictures lack channels.");
    return true;
}

bool pen_metrics_rmse(const struct pen_metrics_image *test,
    const struct pen_metrics_image *reference, uint32_t channels, double *rmse,
    struct pen_error *error)
{
    double sum = 0;
    if (!metrics_check(test, reference, channels, error))
        return false;
    size_t pixels = (size_t)test->width * test->height;
    for (size_t i = 0; i < pixels; i++)
        for (uint32_t c = 0; c < channels; c++) {
            double d = (double)test->data[i * test->stride + c] -
                       (double)reference->data[i * reference->stride + c];
            sum += d * d;
        }
    *rmse = sqrt(sum / ((double)pixels * channels));
    return true;
}

bool pen_metrics_visibility(const struct pen_metrics_image *test,
    const struct pen_metrics_image *reference, struct pen_metrics_visibility *out,
    struct pen_error *error)
{
    double sum = 0, squares = 0, penumbra = 0, largest = 0;
    uint64_t count = 0;
    if (!metrics_check(test, reference, 1, error))
        return false;
    size_t pixels = (size_t)test->width * test->height;
    for (size_t i = 0; i < pixels; i++) {
        double v = (double)reference->data[i * reference->stride];
        double d = (double)test->data[i * test->stride] - v;
        sum += d;
        squares += d * d;
        largest = fmax(largest, fabs(d));
        if (v > 0.02 && v < 0.98) {
            penumbra += d * d;
            count++;
        }
    }
    *out = (struct pen_metrics_visibility){.rmse = sqrt(squares / (double)pixels),
        .penumbra_rmse = count ? sqrt(penumbra / (double)count) : 0,
        .mean_error = sum / (double)pixels,
        .largest = largest,
        .penumbra_pixels = count};
    return true;
}
