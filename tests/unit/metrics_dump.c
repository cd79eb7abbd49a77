/* Reads "width height" and the RGB values of two pictures as text, prints all metrics with their
 * maps, one a line: for metrics.py. */
#include "renderer/metrics/metrics.h"
#include <stdio.h>
#include <stdlib.h>

static void print_line(double mean, const float *map, size_t count)
{
    printf("%.17g", mean);
    for (size_t i = 0; i < count; i++)
        printf(" %.9g", (double)map[i]);
    printf("\n");
}

int main(int argc, char **argv)
{
    unsigned width, height;
    double pixels_per_degree = argc > 1 ? atof(argv[1]) : 0, mean;
    if (scanf("%u %u", &width, &height) != 2 || width > 1000 || height > 1000)
        return 1;
    size_t count = (size_t)width * height;
    float *values = malloc(6 * count * sizeof *values), *map = malloc(count * sizeof *map);
    for (size_t i = 0; i < 6 * count; i++)
        if (scanf("%f", &values[i]) != 1)
            return 1;
    struct pen_metrics_image test = {values, width, height, 3};
    struct pen_metrics_image reference = {values + 3 * count, width, height, 3};
    if (!pen_metrics_rmse(&test, &reference, 3, &mean, NULL))
        return 1;
    print_line(mean, NULL, 0);
    struct pen_metrics_similarity similarity;
    if (!pen_metrics_ssim(&test, &reference, map, &similarity, NULL))
        return 1;
    print_line(similarity.mean, map, count);
    print_line(similarity.contrast, NULL, 0);
    if (!pen_metrics_flip(&test, &reference, pixels_per_degree, map, &mean, NULL))
        return 1;
    print_line(mean, map, count);
    free(values);
    free(map);
    return 0;
}
