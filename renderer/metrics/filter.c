/* Separable filtering. */
#include "renderer/metrics/filter.h"
#include <stddef.h>

static void filter_row(const double *in, double *out, int count,
    const struct metrics_kernel *kernel, enum metrics_border border)
{
    int radius = kernel->radius;
    double total = 0;
    for (int k = -radius; k <= radius; k++)
        total += kernel->weights[k];
    for (int i = 0; i < count; i++) {
        double sum = 0, used = 0;
        for (int k = -radius; k <= radius; k++) {
            int at = i + k, inside = at < 0 ? 0 : at >= count ? count - 1 : at;
            if (border == METRICS_CUT && at != inside)
                continue;
            sum += kernel->weights[k] * in[inside];
            used += kernel->weights[k];
        }
        out[i] = border == METRICS_CUT ? sum * (total / used) : sum;
    }
}

/* All columns at once, row by row, for the cache's sake. */
static void filter_columns(const double *in, double *out, int width, int height,
    const struct metrics_kernel *kernel, enum metrics_border border)
{
    int radius = kernel->radius;
    double total = 0;
    for (int k = -radius; k <= radius; k++)
        total += kernel->weights[k];
    for (int y = 0; y < height; y++) {
        double *to = out + (size_t)y * (size_t)width, used = 0;
        for (int x = 0; x < width; x++)
            to[x] = 0;
        for (int k = -radius; k <= radius; k++) {
            int at = y + k, inside = at < 0 ? 0 : at >= height ? height - 1 : at;
            if (border == METRICS_CUT && at != inside)
                continue;
            const double *from = in + (size_t)inside * (size_t)width;
            double weight = kernel->weights[k];
            used += weight;
            for (int x = 0; x < width; x++)
                to[x] += weight * from[x];
        }
        for (int x = 0; border == METRICS_CUT && x < width; x++)
            to[x] *= total / used;
    }
}

void metrics_filter(const double *image, uint32_t width, uint32_t height,
    const struct metrics_kernel *x, const struct metrics_kernel *y, enum metrics_border border,
    double *scratch, double *out)
{
    for (uint32_t row = 0; row < height; row++)
        filter_row(
            image + (size_t)row * width, scratch + (size_t)row * width, (int)width, x, border);
    filter_columns(scratch, out, (int)width, (int)height, y, border);
}
