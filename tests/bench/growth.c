#include "tests/bench/growth.h"
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#define MAX_ALONG 32

const char *const bench_axis_names[AXES] = {
    "height", "map_size", "light_size", "lights", "triangles"};

/* One method along one axis, by increasing value. */
struct line {
    const char *method;
    uint32_t count;
    double values[MAX_ALONG], ms[MAX_ALONG];
};

double growth_exponent(const double *values, const double *ms, uint32_t count)
{
    double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (uint32_t i = 0; i < count; i++) {
        if (!(values[i] > 0) || !(ms[i] > 0))
            continue;
        double x = log(values[i]), y = log(ms[i]);
        n++, sx += x, sy += y, sxx += x * x, sxy += x * y;
    }
    double spread = n * sxx - sx * sx;
    return n >= 2 && spread > 1e-12 * n * n ? (n * sxy - sx * sy) / spread : NAN;
}

static void insert(struct line *line, double value, double ms)
{
    uint32_t at = line->count;
    if (at == MAX_ALONG)
        return;
    for (; at && line->values[at - 1] > value; at--) {
        line->values[at] = line->values[at - 1];
        line->ms[at] = line->ms[at - 1];
    }
    line->values[at] = value;
    line->ms[at] = ms;
    line->count++;
}

/* The base point of a method and those that left it along the axis. */
static struct line collect(
    const struct growth_point *points, uint32_t count, const char *method, uint32_t axis)
{
    struct line line = {.method = method};
    for (uint32_t i = 0; i < count; i++)
        if (!strcmp(points[i].method, method) && (points[i].axis == axis || points[i].axis == AXES))
            insert(&line, points[i].at[axis], points[i].ms);
    return line;
}

static bool is_first(const struct growth_point *points, uint32_t i)
{
    for (uint32_t k = 0; k < i; k++)
        if (!strcmp(points[k].method, points[i].method))
            return false;
    return true;
}

static double exponent_of(const struct line *line, uint32_t axis)
{
    /* Width follows height: the pixels go with its square. */
    return growth_exponent(line->values, line->ms, line->count) * (axis == AXIS_HEIGHT ? 0.5 : 1);
}

void growth_print(FILE *file, const struct growth_point *points, uint32_t count)
{
    for (uint32_t axis = 0; axis < AXES; axis++) {
        bool begun = false;
        for (uint32_t i = 0; i < count; i++) {
            struct line line = collect(points, count, points[i].method, axis);
            if (!is_first(points, i) || line.count < 2)
                continue;
            if (!begun)
                fprintf(file, "\nGrowth with %s: ms at each value; exponent%s\n",
                    bench_axis_names[axis], axis == AXIS_HEIGHT ? " over the pixels" : "");
            begun = true;
            fprintf(file, "  %-18s", line.method);
            for (uint32_t k = 0; k < line.count; k++)
                fprintf(file, "  %g: %.3f", line.values[k], line.ms[k]);
            fprintf(file, "   exponent %.2f\n", exponent_of(&line, axis));
        }
    }
}

void growth_json(FILE *file, const struct growth_point *points, uint32_t count)
{
    bool first = true;
    fputc('[', file);
    for (uint32_t axis = 0; axis < AXES; axis++)
        for (uint32_t i = 0; i < count; i++) {
            struct line line = collect(points, count, points[i].method, axis);
            double exponent = exponent_of(&line, axis);
            if (!is_first(points, i) || line.count < 2 || !isfinite(exponent))
                continue;
            fprintf(file, "%s\n  {\"axis\": \"%s\", \"method\": \"%s\", \"exponent\": %.3f}",
                first ? "" : ",", bench_axis_names[axis], line.method, exponent);
            first = false;
        }
    fputs("]", file);
}
