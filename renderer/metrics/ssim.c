/* Structural similarity: Wang, Bovik, Sheikh & Simoncelli, 2004. */
#include "renderer/metrics/filter.h"
#include <math.h>
#include <stdlib.h>

#define RADIUS 5
#define SIGMA 1.5
#define C1 (0.01 * 0.01)
#define C2 (0.03 * 0.03)

static double luma(const struct pen_metrics_image *image, size_t pixel)
{
    const float *p = image->data + pixel * image->stride;
    return 0.299 * (double)p[0] + 0.587 * (double)p[1] + 0.114 * (double)p[2];
}

bool pen_metrics_ssim(const struct pen_metrics_image *test,
    const struct pen_metrics_image *reference, float *map, struct pen_metrics_similarity *out,
    struct pen_error *error)
{
    enum { A, B, AA, BB, AB, SCRATCH, PLANES };
    double weights[2 * RADIUS + 1], total = 0, sum = 0, contrasts = 0;
    struct metrics_kernel kernel = {weights + RADIUS, RADIUS};
    if (!metrics_check(test, reference, 3, error))
        return false;
    uint32_t width = test->width, height = test->height;
    size_t pixels = (size_t)width * height, counted = 0;
    double *planes = malloc(PLANES * pixels * sizeof *planes), *plane[PLANES];
    if (!planes)
        return pen_fail(error, PEN_UNAVAILABLE, "", "Out of memory.");
    for (int i = 0; i < PLANES; i++)
        plane[i] = planes + (size_t)i * pixels;
    for (int k = -RADIUS; k <= RADIUS; k++)
        total += kernel.weights[k] = exp(-k * k / (2 * SIGMA * SIGMA));
    for (int k = -RADIUS; k <= RADIUS; k++)
        kernel.weights[k] /= total;
    for (size_t i = 0; i < pixels; i++) {
        double a = luma(test, i), b = luma(reference, i);
        plane[A][i] = a;
        plane[B][i] = b;
        plane[AA][i] = a * a;
        plane[BB][i] = b * b;
        plane[AB][i] = a * b;
    }
    for (int i = 0; i < SCRATCH; i++)
        metrics_filter(
            plane[i], width, height, &kernel, &kernel, METRICS_CUT, plane[SCRATCH], plane[i]);
    bool fits = width > 2 * RADIUS && height > 2 * RADIUS;
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0; x < width; x++) {
            size_t i = (size_t)y * width + x;
            double a = plane[A][i], b = plane[B][i];
            double aa = plane[AA][i] - a * a, bb = plane[BB][i] - b * b;
            double ab = plane[AB][i] - a * b;
            double value =
                (2 * a * b + C1) * (2 * ab + C2) / ((a * a + b * b + C1) * (aa + bb + C2));
            if (map)
                map[i] = (float)value;
            if (fits && (x < RADIUS || y < RADIUS || x + RADIUS >= width || y + RADIUS >= height))
                continue;
            sum += value;
            double deviations = sqrt(fmax(aa, 0) * fmax(bb, 0));
            contrasts += (2 * deviations + C2) / (aa + bb + C2);
            counted++;
        }
    *out = (struct pen_metrics_similarity){sum / (double)counted, contrasts / (double)counted};
    free(planes);
    return true;
}
