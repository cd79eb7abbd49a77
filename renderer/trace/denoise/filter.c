/* How wide the filter is, and the filter. */
#include "renderer/trace/denoise/internal.h"
#include <math.h>
#include <string.h>

#define WIDTH 0.15f /* half the filter's, of the penumbra's */
#define NARROW 2    /* px: less is not filtered enough */
#define RINGS 3     /* blocks around one, whose nearest blockers count when it knows none */
#define LIKE (0.8f * 127 * 127)

/* The pre-test's narrowest penumbra in the blocks around one, px. */
static float reach_around(const struct denoise *d, uint32_t bx, uint32_t by)
{
    float least = INFINITY;
    for (uint32_t ring = 1; ring <= RINGS && least == INFINITY; ring++) {
        uint32_t x0 = bx > ring ? bx - ring : 0, y0 = by > ring ? by - ring : 0;
        for (uint32_t y = y0; y <= by + ring && y < d->blocks_y; y++)
            for (uint32_t x = x0; x <= bx + ring && x < d->blocks_x; x++)
                least = fminf(least, d->reach[y * d->blocks_x + x]);
    }
    return least;
}

/* Its neighbours, or some part of their light, see another share of it. */
static bool disagrees(const struct denoise *d, uint32_t x, uint32_t y)
{
    const float *values = d->value[0] + d->parts - 1;
    uint32_t width = d->job->width, pixel = y * width + x;
    uint32_t x0 = x ? x - 1 : 0, y0 = y ? y - 1 : 0;
    for (uint32_t ny = y0; ny <= y + 1 && ny < d->job->height; ny++)
        for (uint32_t nx = x0; nx <= x + 1 && nx < width; nx++) {
            uint32_t other = ny * width + nx;
            if (d->job->view->depths[other] > 0 &&
                values[(size_t)d->parts * other] != values[(size_t)d->parts * pixel])
                return true;
        }
    return false;
}

static uint32_t plan_block(struct denoise *d, uint32_t bx, uint32_t by)
{
    uint32_t width = d->job->width, height = d->job->height, narrow = 0;
    float reach = reach_around(d, bx, by), half = reach < INFINITY ? WIDTH * reach : 0;
    /* Windows over a power of two have points that are spread well: the next one. */
    uint8_t radius = half < 1 ? 0 : half < NARROW ? 1 : half < 2.8f ? 2 : half < 5.7f ? 4 : 8;
    if (d->emitter.type == PEN_TRACE_POINT)
        radius = 0;
    d->radius[by * d->blocks_x + bx] = radius;
    for (uint32_t y = by * BLOCK; y < (by + 1) * BLOCK && y < height; y++)
        for (uint32_t x = bx * BLOCK; x < (bx + 1) * BLOCK && x < width; x++) {
            bool wanted = radius < NARROW && d->how->refine &&
                          d->job->view->depths[y * width + x] > 0 && disagrees(d, x, y);
            d->wanted[y * width + x] = wanted;
            narrow += wanted;
        }
    return narrow;
}

void denoise_plan(void *context, uint32_t tile)
{
    struct denoise *d = context;
    uint32_t at[2], narrow = 0;
    denoise_tile_at(d, tile, at);
    for (uint32_t by = at[1] / BLOCK; by < (at[1] + TILE) / BLOCK && by < d->blocks_y; by++)
        for (uint32_t bx = at[0] / BLOCK; bx < (at[0] + TILE) / BLOCK && bx < d->blocks_x; bx++)
            if (d->work[denoise_half(d, bx * BLOCK, by * BLOCK)])
                narrow += plan_block(d, bx, by);
    atomic_fetch_add(&d->narrow, narrow);
}

/* A box of 2 radius, over what lies in the pixel's own surface. The point q of a pixel at (x, y) is
 * eye + ray / depth with a ray that is linear in x and y, so its distance from the plane of p is
 * n . ray(q) / depth(q) - n . ray(p) / depth(p). */
static void filter_pixel(const struct denoise *d, const float *from, const uint32_t at[2],
    int32_t radius, int axis, float out[4])
{
    const struct pen_trace_view *view = d->job->view;
    uint32_t size = axis ? d->job->height : d->job->width, step = axis ? d->job->width : 1;
    uint32_t parts = d->parts, pixel = at[1] * d->job->width + at[0];
    const int8_t *n = d->normals[pixel];
    const float normal[3] = {(float)n[0] / 127, (float)n[1] / 127, (float)n[2] / 127};
    float ray[3], depth = view->depths[pixel], sum[4] = {0}, weight = 1;
    memcpy(sum, from + (size_t)parts * pixel, parts * sizeof *sum);
    for (int c = 0; c < 3; c++)
        ray[c] = view->first[c] + (float)at[0] * view->right[c] + (float)at[1] * view->down[c];
    float along = trace_dot(normal, ray);
    float slope = trace_dot(normal, axis ? view->down : view->right), inverse = 1 / depth;
    int32_t low = -radius, high = radius;
    low = low < -(int32_t)at[axis] ? -(int32_t)at[axis] : low;
    high = high > (int32_t)(size - 1 - at[axis]) ? (int32_t)(size - 1 - at[axis]) : high;
    for (int32_t o = low; o <= high; o++) {
        size_t other = (size_t)((int64_t)pixel + (int64_t)o * step);
        const int8_t *m = d->normals[other];
        float ratio = view->depths[other] * inverse, off = (float)o;
        float distance = fabsf(along * (1 - ratio) + off * slope);
        float like = (float)(n[0] * m[0] + n[1] * m[1] + n[2] * m[2]);
        float w = o == 0 ? 0 : o == -radius || o == radius ? 0.5f : 1;
        w = distance <= (fabsf(off) + 0.5f) * d->pixel * ratio && like >= LIKE ? w : 0;
        weight += w;
        for (uint32_t c = 0; c < parts; c++)
            sum[c] += w * from[parts * other + c];
    }
    for (uint32_t c = 0; c < parts; c++)
        out[c] = sum[c] / weight;
}

static uint8_t radius_at(const struct denoise *d, uint32_t x, uint32_t y)
{
    uint32_t block = y / BLOCK * d->blocks_x + x / BLOCK;
    if (!d->work[denoise_half(d, x, y)] || !(d->job->view->depths[y * d->job->width + x] > 0))
        return 0;
    return d->capped && d->radius[block] < NARROW ? NARROW : d->radius[block];
}

static void put(struct denoise *d, uint32_t pixel, const float *value, float scale)
{
    uint16_t *out = d->halves + 4 * (size_t)pixel;
    float a = scale * value[d->parts - 1];
    out[3] = pen_trace_half(a < 1 ? a : 1);
    for (uint32_t c = 0; c < 3; c++)
        out[c] = d->parts == 4 ? pen_trace_half(scale * value[c]) : out[3];
}

/* Without work: as the pre-test said. */
static void put_half(struct denoise *d, uint32_t x0, uint32_t y0)
{
    const float *depths = d->job->view->depths;
    uint32_t width = d->job->width, height = d->job->height;
    bool umbra = d->verdicts[denoise_half(d, x0, y0)] == UMBRA;
    for (uint32_t y = y0; y < y0 + HALF && y < height; y++)
        for (uint32_t x = x0; x < x0 + HALF && x < width; x++) {
            size_t pixel = (size_t)y * width + x;
            bool dark = umbra && depths[pixel] > 0;
            memcpy(d->halves + 4 * pixel, dark ? d->dark : d->lit, sizeof d->lit);
        }
}

static void filter_half(struct denoise *d, uint32_t x0, uint32_t y0, int axis)
{
    uint32_t width = d->job->width, height = d->job->height;
    for (uint32_t y = y0; y < y0 + HALF && y < height; y++)
        for (uint32_t x = x0; x < x0 + HALF && x < width; x++) {
            size_t pixel = (size_t)y * width + x, first = d->parts * pixel;
            const uint32_t at[2] = {x, y};
            uint8_t radius = radius_at(d, x, y);
            float filtered[4], *out = axis ? filtered : d->value[1] + first;
            if (radius)
                filter_pixel(d, d->value[axis], at, radius, axis, out);
            else if (!axis)
                memcpy(out, d->value[0] + first, d->parts * sizeof *out);
            if (axis)
                put(d, (uint32_t)pixel, radius ? out : d->value[1] + first, d->fade[pixel]);
        }
}

static void filter_tile(struct denoise *d, uint32_t tile, int axis)
{
    uint32_t at[2];
    denoise_tile_at(d, tile, at);
    for (uint32_t y = at[1]; y < at[1] + TILE && y < d->job->height; y += HALF)
        for (uint32_t x = at[0]; x < at[0] + TILE && x < d->job->width; x += HALF) {
            uint32_t half = denoise_half(d, x, y);
            if (d->work[half] || (!axis && d->near[half]))
                filter_half(d, x, y, axis);
            else if (axis)
                put_half(d, x, y);
        }
}

void denoise_filter_x(void *context, uint32_t tile)
{
    filter_tile(context, tile, 0);
}

void denoise_filter_y(void *context, uint32_t tile)
{
    filter_tile(context, tile, 1);
}
