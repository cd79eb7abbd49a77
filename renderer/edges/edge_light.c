#include "renderer/edges/edge_light.h"
#include "protocol/srgb.h"
#include "renderer/trace/parallel.h"
#include <math.h>
#include <string.h>

#define SAME 1 /* of 255: blending what differs by no more changes no more */
#define AROUND (COVER_TILE + 2)
#define GUESSES 1024
#define BEHIND 0.998f /* what is less than this behind something may be part of it */
#define HALF_MAX 65504.0f
#define MIXED 0.3f  /* as much of its neighbours' light has a place that its own plane explains */
#define CENTRE 0.5f /* weight of what was shaded, over that of a place */
#define AROUND_PIXELS 9
#define OWN 4

typedef cover_places four;

/* A number that is linear over the picture: at a pixel's centre, and per pixel. */
struct plane {
    float at, across, down;
};

/* A plane as places ask it. */
struct surface {
    struct plane plane;
    four places; /* its depth at each of the pixel's own */
    float rise;  /* per pixel */
};

/* What is seen at a pixel. */
struct look {
    four light; /* times alpha */
    struct surface solid, front;
};

/* A tile, and what lies beside it. */
struct around {
    const struct edge_rows *e;
    uint32_t x, y;
    uint64_t known; /* bits, as looks */
    struct look looks[AROUND * AROUND];
};

static float linear_of[256];
static float code_begins[257]; /* the least light that is nearest to a code */
static uint8_t guesses[GUESSES];
static four nearness[AROUND_PIXELS]; /* of each of 3 x 3 pixels to the places */

static void make_tables(void)
{
    if (code_begins[256] > 0)
        return;
    for (int i = 0; i < 256; i++)
        linear_of[i] = (float)pen_srgb_decode(i / 255.0);
    for (int i = 1; i < 256; i++)
        code_begins[i] = (float)pen_srgb_decode((i - 0.5) / 255);
    for (int i = 0, code = 0; i < GUESSES; i++) {
        while (code < 255 && code_begins[code + 1] <= (float)i / GUESSES)
            code++;
        guesses[i] = (uint8_t)code;
    }
    for (int k = 0; k < AROUND_PIXELS; k++) {
        four across = (float)(k % 3 - 1) - cover_across, down = (float)(k / 3 - 1) - cover_down;
        nearness[k] = 1 / (1 + across * across + down * down);
    }
    code_begins[256] = INFINITY;
}

static uint8_t code_of(float light)
{
    if (!(light > 0))
        return 0;
    if (light >= 1)
        return 255;
    uint32_t code = guesses[(int)(light * GUESSES)];
    while (light >= code_begins[code + 1])
        code++;
    return (uint8_t)code;
}

static four all(float value)
{
    return (four){value, value, value, value};
}

static four choose(cover_bits which, four a, four b)
{
    return (four)((which & (cover_bits)a) | (~which & (cover_bits)b));
}

static four size(four a)
{
    return (four)((cover_bits)a & 0x7fffffff);
}

static four larger(four a, four b)
{
    return choose(a > b, a, b);
}

static bool any(cover_bits bits)
{
    typedef int64_t pairs __attribute__((vector_size(16)));
    pairs p = (pairs)bits;
    return p[0] | p[1];
}

static four load(const float *from)
{
    four v;
    memcpy(&v, from, sizeof v);
    return v;
}

uint32_t edge_stride(uint32_t width)
{
    return (width + COVER_TILE - 1) / COVER_TILE * COVER_TILE + 2 * EDGE_MARGIN;
}

uint32_t edge_pixel_bytes(const struct pen_plane *plane)
{
    return plane->pixel == PEN_PIXEL_RGBA8 ? 4 : plane->pixel == PEN_PIXEL_RGBA16F ? 8 : 16;
}

/* Of the row `number` of the picture, whose column 0 it points to. */
static float *row_at(const struct edge_rows *e, float *depths, uint32_t number)
{
    return depths + (size_t)(number + 1 - e->first) * edge_stride(e->view->width) + EDGE_MARGIN;
}

void edge_pad(const struct edge_rows *e, float *depths)
{
    uint32_t width = e->view->width, height = e->view->height, stride = edge_stride(width);
    uint32_t end = e->first + (e->rows + COVER_TILE - 1) / COVER_TILE * COVER_TILE + 1;
    for (uint32_t y = e->first ? e->first - 1 : 0; y < end && y < height; y++) {
        float *row = row_at(e, depths, y);
        row[-1] = row[0];
        for (uint32_t x = width; x < stride - EDGE_MARGIN; x++)
            row[x] = row[width - 1];
    }
    if (e->first == 0)
        memcpy(depths, depths + stride, stride * sizeof *depths);
    for (uint32_t y = height; y < end; y++)
        memcpy(row_at(e, depths, y) - EDGE_MARGIN, row_at(e, depths, height - 1) - EDGE_MARGIN,
            stride * sizeof *depths);
}

/* Along a plane a depth is the mean of those on either side. A bit for each of four pixels. */
static uint32_t bent_pixels(const float *row, uint32_t stride)
{
    four depth = load(row), left = load(row - 1), right = load(row + 1);
    four above = load(row - stride), below = load(row + stride), twice = depth + depth;
    four bend = larger(size(left + right - twice), size(above + below - twice));
    four rise = size(left - right) + size(above - below) + 1e-2f * depth;
    cover_bits bent = (bend > 0.03f * rise) & (cover_bits){1, 2, 4, 8};
    return any(bent) ? (uint32_t)(bent[0] | bent[1] | bent[2] | bent[3]) : 0;
}

static uint32_t bent_in_tile(const struct edge_rows *e, float *depths, uint32_t x, uint32_t y)
{
    uint32_t bits = 0, stride = edge_stride(e->view->width);
    const float *row = row_at(e, depths, y) + x;
    for (uint32_t i = 0; i < COVER_TILE; i++, row += stride)
        bits |= bent_pixels(row, stride) << COVER_TILE * i;
    return bits;
}

static four smaller(four a, four b)
{
    return choose(a < b, a, b);
}

/* Of each of a tile's pixels the farthest of those around. */
static void farthest_around(const struct edge_rows *e, uint32_t x, uint32_t y, four far[COVER_TILE])
{
    uint32_t stride = edge_stride(e->view->width);
    const float *row = row_at(e, e->solid.depths, y) + x - stride;
    four rows[AROUND];
    for (uint32_t i = 0; i < AROUND; i++, row += stride)
        rows[i] = smaller(load(row), smaller(load(row - 1), load(row + 1)));
    for (uint32_t i = 0; i < COVER_TILE; i++)
        far[i] = smaller(rows[i], smaller(rows[i + 1], rows[i + 2]));
}

static uint32_t clamped(uint32_t i, int step, uint32_t count)
{
    return (step < 0 && i == 0) || (step > 0 && i + 1 == count) ? i : i + (uint32_t)step;
}

static const uint8_t *before_at(const struct edge_rows *e, uint32_t x, uint32_t y)
{
    size_t pixel = (size_t)(y + 1 - e->first) * e->view->width + x;
    return e->before + pixel * edge_pixel_bytes(e->plane);
}

/* Not one colour all around. */
static bool differs(const struct edge_rows *e, uint32_t x, uint32_t y)
{
    if (e->plane->pixel != PEN_PIXEL_RGBA8)
        return true;
    const uint8_t *own = before_at(e, x, y);
    for (int down = -1; down <= 1; down++)
        for (int across = -1; across <= 1; across++) {
            const uint8_t *other =
                before_at(e, clamped(x, across, e->view->width), clamped(y, down, e->view->height));
            for (int k = 0; k < 4; k++)
                if (own[k] > other[k] + SAME || other[k] > own[k] + SAME)
                    return true;
        }
    return false;
}

/* Of a tile's pixels, bits, those in the picture, and where it is not of one colour. */
static uint32_t shown_pixels(const struct edge_rows *e, uint32_t x, uint32_t y, uint32_t bits)
{
    uint32_t shown = 0;
    for (; bits; bits &= bits - 1) {
        uint32_t bit = (uint32_t)__builtin_ctz(bits);
        uint32_t px = x + bit % COVER_TILE, py = y + bit / COVER_TILE;
        if (px < e->view->width && py < e->view->height && differs(e, px, py))
            shown |= 1u << bit;
    }
    return shown;
}

static uint32_t wanted_pixels(const struct edge_rows *e, bool all, uint32_t x, uint32_t y)
{
    uint32_t bits = bent_in_tile(e, e->solid.depths, x, y);
    if (e->layered)
        bits |= bent_in_tile(e, e->nearest, x, y);
    return all ? bits : shown_pixels(e, x, y, bits);
}

static uint32_t tiles_across(const struct edge_rows *e)
{
    return (e->view->width + COVER_TILE - 1) / COVER_TILE;
}

/* What threads do with rows of tiles, and between which rows. */
struct rows_work {
    const struct edge_rows *e;
    struct cover_tile *tiles;
    const struct cover_tile *all;
    uint32_t first;
    bool any;
};

static void in_rows(struct rows_work *rows, uint32_t end, void (*run)(void *context, uint32_t item))
{
    uint32_t count = (end - rows->first + COVER_TILE - 1) / COVER_TILE;
    const struct trace_work work = {run, rows, count, NULL, 0, NULL};
    double cpu_seconds = 0;
    trace_parallel(trace_thread_count(0), &work, &cpu_seconds);
}

static void find_row(void *context, uint32_t item)
{
    const struct rows_work *rows = context;
    uint32_t y = rows->first + item * COVER_TILE, across = tiles_across(rows->e);
    for (uint32_t column = 0; column < across; column++)
        rows->tiles[y / COVER_TILE * across + column] = (struct cover_tile){
            .pixels = wanted_pixels(rows->e, rows->any, column * COVER_TILE, y)};
}

uint32_t edge_find(const struct edge_rows *e, bool all, struct cover_tile *tiles)
{
    struct rows_work rows = {.e = e, .tiles = tiles, .first = e->first, .any = all};
    uint32_t across = tiles_across(e), slots = 0, end = e->first + e->rows;
    in_rows(&rows, end, find_row);
    struct cover_tile *last = &tiles[(end + COVER_TILE - 1) / COVER_TILE * across];
    for (struct cover_tile *tile = &tiles[e->first / COVER_TILE * across]; tile < last; tile++)
        if (tile->pixels)
            tile->slot = slots++;
    return slots;
}

void edge_begin(
    const struct edge_rows *e, struct cover_tile *tiles, cover_places *places, float *leasts)
{
    uint32_t across = tiles_across(e);
    for (uint32_t y = e->first; y < e->first + e->rows; y += COVER_TILE)
        for (uint32_t column = 0; column < across; column++) {
            struct cover_tile *tile = &tiles[y / COVER_TILE * across + column];
            cover_places *at = places + (size_t)tile->slot * COVER_PIXELS;
            float *of_pixel = leasts + (size_t)tile->slot * COVER_PIXELS;
            four far[COVER_TILE];
            if (!tile->pixels)
                continue;
            farthest_around(e, column * COVER_TILE, y, far);
            tile->farthest = 1;
            for (uint32_t i = 0; i < COVER_PIXELS; i++)
                of_pixel[i] = INFINITY;
            for (uint32_t left = tile->pixels; left; left &= left - 1) {
                uint32_t bit = (uint32_t)__builtin_ctz(left);
                float least = BEHIND * far[bit / COVER_TILE][bit % COVER_TILE];
                at[bit] = all(least);
                of_pixel[bit] = least;
                tile->farthest = least < tile->farthest ? least : tile->farthest;
            }
        }
}

static void choose_row(void *context, uint32_t item)
{
    const struct rows_work *rows = context;
    uint32_t y = rows->first + item * COVER_TILE, across = tiles_across(rows->e);
    for (uint32_t column = 0; column < across; column++) {
        uint32_t i = y / COVER_TILE * across + column;
        rows->tiles[i] = rows->all[i];
        rows->tiles[i].pixels = shown_pixels(rows->e, column * COVER_TILE, y, rows->all[i].pixels);
    }
}

void edge_choose(const struct edge_rows *e, const struct cover_tile *all, struct cover_tile *tiles)
{
    struct rows_work rows = {.e = e, .tiles = tiles, .all = all, .first = e->first};
    in_rows(&rows, e->first + e->rows, choose_row);
}

static float dot(const float a[3], const float b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* octahedral_direction() */
static void direction(const uint16_t code[4], float n[3])
{
    n[0] = (float)code[0] * (2 / 65535.0f) - 1;
    n[1] = (float)code[1] * (2 / 65535.0f) - 1;
    n[2] = 1 - fabsf(n[0]) - fabsf(n[1]);
    float t = n[2] < 0 ? -n[2] : 0;
    n[0] += n[0] >= 0 ? -t : t;
    n[1] += n[1] >= 0 ? -t : t;
}

/* plane_of() */
static struct surface surface_of(
    const struct edge_rows *e, float depth, const uint16_t normal[4], uint32_t x, uint32_t y)
{
    const struct view *v = e->view;
    float n[3];
    direction(normal, n);
    float across = dot(n, v->right) / e->focal, down = -dot(n, v->up) / e->focal;
    float facing = dot(n, v->forward) + across * ((float)x + 0.5f - 0.5f * (float)v->width) +
                   down * ((float)y + 0.5f - 0.5f * (float)v->height);
    float scale = depth / (facing < -1e-4f ? facing : -1e-4f);
    struct plane p = {depth, across * scale, down * scale};
    return (struct surface){.plane = p,
        .places = p.at + p.across * cover_across + p.down * cover_down,
        .rise = fabsf(p.across) + fabsf(p.down) + 1e-20f};
}

static float half_to_float(uint16_t half)
{
    uint32_t bits = (uint32_t)(half & 0x7fff) << 13;
    float value;
    memcpy(&value, &bits, sizeof value);
    return half & 0x8000 ? -value * 0x1p112f : value * 0x1p112f;
}

/* Of what is finite and not negative; to the nearest, even ones first. */
static uint16_t float_to_half(float value)
{
    uint32_t bits;
    value = (value < HALF_MAX ? value : HALF_MAX) * 0x1p-112f;
    memcpy(&bits, &value, sizeof bits);
    return (uint16_t)((bits + 0xfff + (bits >> 13 & 1)) >> 13);
}

/* light_of() */
static four light_at(const struct edge_rows *e, uint32_t x, uint32_t y)
{
    const uint8_t *at = before_at(e, x, y);
    float c[4];
    if (e->plane->pixel == PEN_PIXEL_RGBA8) {
        float a = (float)at[3] / 255;
        return (four){linear_of[at[0]], linear_of[at[1]], linear_of[at[2]], 1} * a;
    }
    for (int k = 0; k < 4; k++)
        if (e->plane->pixel == PEN_PIXEL_RGBA16F)
            c[k] = half_to_float(((const uint16_t *)(const void *)at)[k]);
        else
            c[k] = ((const float *)(const void *)at)[k];
    for (int k = 0; k < 3 && !e->raw; k++)
        c[k] = pen_srgb_decodef(c[k]) * c[3];
    return load(c);
}

static void store_light(const struct edge_rows *e, uint32_t x, uint32_t y, four light)
{
    uint8_t *at = e->plane->data;
    at += ((size_t)y * e->view->width + x) * edge_pixel_bytes(e->plane);
    float alpha = light[3];
    if (!e->raw)
        light = alpha > 0 ? light / alpha : all(0);
    for (int k = 0; k < 4; k++) {
        float value = k == 3 ? alpha : light[k];
        if (e->plane->pixel == PEN_PIXEL_RGBA8)
            at[k] = k == 3 ? (uint8_t)(255 * (alpha < 1 ? alpha : 1) + 0.5f) : code_of(value);
        else if (e->plane->pixel == PEN_PIXEL_RGBA16F)
            ((uint16_t *)(void *)at)[k] = float_to_half(value);
        else
            ((float *)(void *)at)[k] = k == 3 || e->raw ? value : pen_srgb_encodef(value);
    }
}

static const struct look *look_at(struct around *a, uint32_t x, uint32_t y)
{
    const struct edge_rows *e = a->e;
    uint32_t i = (y + 1 - a->y) * AROUND + (x + 1 - a->x), width = e->view->width;
    struct look *look = &a->looks[i];
    if (a->known >> i & 1)
        return look;
    a->known |= UINT64_C(1) << i;
    size_t normal = (size_t)(y + 1 - e->first) * width + x;
    look->light = light_at(e, x, y);
    float depth = row_at(e, e->solid.depths, y)[x];
    look->solid = look->front = surface_of(e, depth, e->solid.normals[normal], x, y);
    float before = e->layered ? row_at(e, e->front.depths, y)[x] : 0;
    if (before > 0)
        look->front = surface_of(e, before, e->front.normals[normal], x, y);
    return look;
}

/* match() */
static four match(const struct surface *s, four depths, float across, float down)
{
    const struct plane *plane = &s->plane;
    if (plane->at == 0)
        return choose(depths == 0.0f, all(10), all(1e-9f));
    four miss = size(s->places - (plane->across * across + plane->down * down) - depths);
    four rise = s->rise + 2e-3f * larger(depths, all(plane->at));
    return rise / (miss + 0.1f * rise);
}

static four match_both(const struct edge_rows *e, const struct look *look, four solid, four front,
    float across, float down)
{
    four how = match(&look->solid, solid, across, down);
    if (e->layered)
        how = -larger(-how, -match(&look->front, front, across, down));
    return how;
}

static float sum_of(four a)
{
    return (a[0] + a[1]) + (a[2] + a[3]);
}

/* As edges.frag. slot: number of the pixel's places. */
static void blend_pixel(struct around *a, uint32_t x, uint32_t y, size_t slot)
{
    const struct edge_rows *e = a->e;
    four solid = e->solid.places[slot];
    four front = e->layered ? larger(solid, e->front.places[slot]) : solid;
    const struct look *looks[AROUND_PIXELS];
    looks[OWN] = look_at(a, x, y);
    four own = match_both(e, looks[OWN], solid, front, 0, 0);
    four open = 4 - 0.42f * own; /* 0 where the pixel's own plane explains the place */
    if (!any(open > 0.0f))
        return;
    open = choose(open < 1.0f, larger(open, all(MIXED)), all(1));
    four weights[AROUND_PIXELS], sum = weights[OWN] = own * nearness[OWN];
    for (int k = 0; k < AROUND_PIXELS; k++) {
        if (k == OWN)
            continue;
        uint32_t px = clamped(x, k % 3 - 1, e->view->width);
        uint32_t py = clamped(y, k / 3 - 1, e->view->height);
        looks[k] = look_at(a, px, py);
        weights[k] = match_both(
            e, looks[k], solid, front, (float)(int32_t)(px - x), (float)(int32_t)(py - y));
        sum += weights[k] *= open * nearness[k];
    }
    four light = all(0), share = 1 / ((COVER_PLACES + CENTRE) * sum);
    for (int k = 0; k < AROUND_PIXELS; k++)
        light += sum_of(weights[k] * share) * looks[k]->light;
    light += CENTRE / (COVER_PLACES + CENTRE) * looks[OWN]->light;
    store_light(e, x, y, light);
}

static void blend_row(void *context, uint32_t item)
{
    const struct rows_work *rows = context;
    uint32_t y = rows->first + item * COVER_TILE, across = tiles_across(rows->e);
    for (uint32_t column = 0; column < across; column++) {
        const struct cover_tile *tile = &rows->tiles[y / COVER_TILE * across + column];
        struct around around;
        around.e = rows->e, around.x = column * COVER_TILE, around.y = y, around.known = 0;
        for (uint32_t left = tile->pixels; left; left &= left - 1) {
            uint32_t bit = (uint32_t)__builtin_ctz(left);
            blend_pixel(&around, around.x + bit % COVER_TILE, y + bit / COVER_TILE,
                (size_t)tile->slot * COVER_PIXELS + bit);
        }
    }
}

void edge_blend(const struct edge_rows *e, struct cover_tile *tiles, uint32_t first, uint32_t end)
{
    struct rows_work rows = {.e = e, .tiles = tiles, .first = first};
    make_tables();
    in_rows(&rows, end, blend_row);
}
