/* How the cost of a method grows along one axis, from the points that were measured. */
#pragma once
#include <stdint.h>
#include <stdio.h>

enum bench_axis { AXIS_HEIGHT, AXIS_MAP, AXIS_LIGHT_SIZE, AXIS_LIGHTS, AXIS_TRIANGLES, AXES };
extern const char *const bench_axis_names[AXES];

struct growth_point {
    const char *method;
    uint32_t axis; /* enum bench_axis: the one that left its first value; AXES: the base */
    double at[AXES];
    double ms;
};

/* Slope of log ms over log value by least squares, in [-inf, inf]: 1 when the cost is proportional
 * to the value, 0 when it does not depend on it. Points with nothing positive are left out; NAN
 * when fewer than two different values remain. */
double growth_exponent(const double *values, const double *ms, uint32_t count);

/* One table per axis with more than one value: a line per method with the milliseconds at each
 * value and the exponent (along the resolution that of the number of pixels). */
void growth_print(FILE *file, const struct growth_point *points, uint32_t count);
/* The same as a JSON array. */
void growth_json(FILE *file, const struct growth_point *points, uint32_t count);
