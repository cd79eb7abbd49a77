/* From a light as it is asked for to what the inner loop and the hierarchy need. */
#include "renderer/trace/embree/packet.h"
#include <stdlib.h>
#include <string.h>

#define POINTS 65536u /* of a round light, to average its emission */

bool trace_emitter_average(const struct trace_emitter *e, float mean[3], struct pen_error *error)
{
    double sum[3] = {0};
    size_t texels = (size_t)e->columns * e->rows;
    if (!e->emission) {
        mean[0] = mean[1] = mean[2] = 1;
        return true;
    }
    if (e->type == PEN_TRACE_RECT) {
        for (size_t i = 0; i < texels; i++)
            for (int c = 0; c < 3; c++)
                sum[c] += e->emission[4 * i + (size_t)c];
        for (int c = 0; c < 3; c++)
            mean[c] = (float)(sum[c] / (double)texels);
        return true;
    }
    uint32_t *xs = malloc(2 * (size_t)POINTS * sizeof *xs), *ys = xs ? xs + POINTS : NULL;
    if (!xs || !trace_samples_net(0, POINTS, 0, xs, ys)) {
        free(xs);
        return pen_fail(error, PEN_UNAVAILABLE, "", "Out of memory.");
    }
    for (uint32_t i = 0; i < POINTS; i++) {
        float u = (float)xs[i] * 0x1p-31f - 1, v = (float)ys[i] * 0x1p-31f - 1, rgb[3];
        trace_disk_point(&u, &v);
        trace_emission_at(e, u, v, rgb);
        for (int c = 0; c < 3; c++)
            sum[c] += (double)rgb[c];
    }
    for (int c = 0; c < 3; c++)
        mean[c] = (float)(sum[c] / POINTS);
    free(xs);
    return true;
}

struct trace_emitter trace_emitter_of(const struct pen_trace_light *light)
{
    bool point = light->type == PEN_TRACE_POINT, rectangle = light->type == PEN_TRACE_RECT;
    struct trace_emitter e = {.type = light->type,
        .half = {light->half[0], light->half[rectangle ? 1 : 0]},
        .cos_cone = light->cos_cone,
        .emission = point ? NULL : light->emission,
        .columns = light->columns,
        .rows = light->rows,
        .bilinear = light->bilinear};
    if (point)
        e.half[0] = e.half[1] = 0;
    for (int c = 0; c < 3; c++) {
        e.origin[c] = light->origin[c];
        e.z[c] = light->z[c];
        e.a[c] = e.half[0] * light->x[c];
        e.b[c] = e.half[1] * light->y[c];
    }
    return e;
}

struct trace_silhouette trace_silhouette_of(const struct trace_emitter *e)
{
    struct trace_silhouette s = {.shape = e->type == PEN_TRACE_SPHERE ? TRACE_BALL
                                          : e->type == PEN_TRACE_DISK ? TRACE_ROUND
                                          : e->type == PEN_TRACE_SUN  ? TRACE_PARALLEL
                                                                      : TRACE_SQUARE};
    for (int c = 0; c < 3; c++) {
        s.center[c] = s.shape == TRACE_PARALLEL ? -e->z[c] : e->origin[c];
        s.a[c] = e->a[c];
        s.b[c] = e->b[c];
    }
    if (s.shape == TRACE_BALL) {
        memset(s.a, 0, sizeof s.a);
        memset(s.b, 0, sizeof s.b);
        s.a[0] = e->half[0];
    }
    return s;
}
