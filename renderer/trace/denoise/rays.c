/* The pre-test, and the rays of both levels. */
#include "renderer/trace/denoise/internal.h"
#include <math.h>
#include <string.h>

/* How far the light's middle is above a receiver's horizon, less how far its edge may be below. */
static float least_height(const struct denoise *d, const struct trace_packet *p, uint32_t lane)
{
    float a = fabsf(p->cos_a[lane]), b = fabsf(p->cos_b[lane]);
    return p->cos_base[lane] - (d->emitter.type == PEN_TRACE_RECT ? a + b : hypotf(a, b));
}

/* A receiver in each 2 x 2 pixels of a half, where there is one, and the point of a grid over the light
 * that its ray aims at: such that each block looks at all sides of it. */
static uint32_t gather_pretest(const struct denoise *d, uint32_t x0, uint32_t y0,
    struct trace_receiver receivers[TRACE_LANES], int32_t u[TRACE_LANES], int32_t v[TRACE_LANES])
{
    static const int32_t grid[] = {-INT32_MAX, -INT32_MAX / 3, INT32_MAX / 3, INT32_MAX};
    uint32_t count = 0, width = d->job->width, height = d->job->height;
    for (uint32_t cell = 0; cell < TRACE_LANES; cell++) {
        uint32_t cx = cell & 3, cy = cell >> 2;
        for (uint32_t k = 0; k < 4; k++) {
            uint32_t turn = (cell + k) & 3;
            uint32_t x = x0 + 2 * cx + (turn & 1), y = y0 + 2 * cy + (turn >> 1);
            if (x >= width || y >= height ||
                !trace_receiver_read(
                    d->job, d->pieces.scene->extent, y * width + x, &receivers[count]))
                continue;
            u[count] = grid[2 * (cx & 1) + (cx >> 1)];
            v[count++] = grid[2 * (cy & 1) + (cy >> 1)];
            break;
        }
    }
    for (uint32_t i = count; i < TRACE_LANES; i++)
        u[i] = v[i] = 0;
    return count;
}

static void pretest_half(struct denoise *d, uint32_t x0, uint32_t y0)
{
    struct trace_receiver receivers[TRACE_LANES];
    struct trace_packet packet;
    struct trace_nearest nearest;
    int32_t u[TRACE_LANES], v[TRACE_LANES];
    bool seen = false, hidden = false;
    uint32_t count = gather_pretest(d, x0, y0, receivers, u, v);
    uint8_t *verdict = &d->verdicts[denoise_half(d, x0, y0)];
    for (uint32_t k = 0; k < 4; k++) {
        uint32_t bx = x0 / BLOCK + (k & 1), by = y0 / BLOCK + (k >> 1);
        if (bx < d->blocks_x && by < d->blocks_y)
            d->reach[by * d->blocks_x + bx] = INFINITY;
    }
    *verdict = NO_RECEIVER;
    if (!count)
        return;
    trace_packet_load(&packet, &d->emitter, receivers, count, 0, 0);
    trace_packet_nearest(&d->emitter, &packet, u, v, &nearest);
    for (uint32_t lane = 0; lane < count; lane++) {
        uint32_t x = receivers[lane].pixel % d->job->width,
                 y = receivers[lane].pixel / d->job->width;
        float t = nearest.distance[lane], *reach = &d->reach[y / BLOCK * d->blocks_x + x / BLOCK];
        float ratio = d->emitter.type == PEN_TRACE_SUN ? t : t / fmaxf(1 - t, 1e-6f);
        if (t < INFINITY)
            *reach = fminf(
                *reach, d->size * ratio * d->job->view->depths[receivers[lane].pixel] / d->pixel);
        seen |= nearest.share[lane] > 0;
        hidden |=
            nearest.share[lane] < 1 || !packet.active[lane] || least_height(d, &packet, lane) <= 0;
    }
    *verdict = !seen ? UMBRA : hidden ? MIXED : LIT;
    atomic_fetch_add(&d->rays, nearest.rays);
}

void denoise_pretest(void *context, uint32_t tile)
{
    struct denoise *d = context;
    uint32_t at[2];
    denoise_tile_at(d, tile, at);
    for (uint32_t y = at[1]; y < at[1] + TILE && y < d->job->height; y += HALF)
        for (uint32_t x = at[0]; x < at[0] + TILE && x < d->job->width; x += HALF)
            if (!trace_is_late(&d->pieces))
                pretest_half(d, x, y);
}

static void set_value(struct denoise *d, uint32_t pixel, const float rgb[3], float a)
{
    float *value = d->value[0] + (size_t)d->parts * pixel;
    if (d->parts == 4)
        memcpy(value, rgb, 3 * sizeof *rgb);
    value[d->parts - 1] = a;
}

static void set_normal(struct denoise *d, uint32_t pixel, const float n[3], float length)
{
    float scale = 127 / length;
    for (int c = 0; c < 3; c++) /* to the next one */
        d->normals[pixel][c] = (int8_t)((int)(scale * n[c] + 128.5f) - 128);
}

/* A block is all lit or all in umbra. */
static void fill_block(struct denoise *d, uint32_t x0, uint32_t y0, bool umbra)
{
    static const float zero[3];
    const struct pen_trace_view *view = d->job->view;
    uint32_t width = d->job->width, height = d->job->height;
    for (uint32_t y = y0; y < y0 + BLOCK && y < height; y++)
        for (uint32_t x = x0; x < x0 + BLOCK && x < width; x++) {
            uint32_t pixel = y * width + x;
            bool is = view->depths[pixel] > 0, dark = is && umbra;
            float n[3] = {0}, length = 1;
            if (is) {
                trace_normal_decode(view->normals + 4 * (size_t)pixel, n);
                length = sqrtf(trace_dot(n, n));
            }
            set_value(d, pixel, dark ? zero : d->mean_emission, dark ? 0 : 1);
            set_normal(d, pixel, n, length);
        }
}

/* Adds what `sums` says of a receiver to what is known of it. */
static void add_value(
    struct denoise *d, uint32_t pixel, const struct trace_sums *sums, uint32_t lane)
{
    float *value = d->value[0] + (size_t)d->parts * pixel, *a = value + d->parts - 1;
    float before = d->above[pixel];
    float above = before + (float)sums->above[lane];
    float visible =
        *a * before + (d->mode & TRACE_SHARES ? sums->visible[lane] : (float)sums->count[lane]);
    bool whole = *a * before + (float)sums->count[lane] == above;
    for (uint32_t c = 0; c + 1 < d->parts && above > 0; c++) {
        float mean = (value[c] * before + sums->rgb[c][lane]) / above;
        value[c] = whole ? d->mean_emission[c] : mean; /* no noise where nothing is hidden */
    }
    *a = above > 0 ? whole ? 1 : visible / above : 0;
}

static float horizon_fade(const struct denoise *d, const struct trace_packet *packet, uint32_t lane)
{
    if (!packet->active[lane]) /* no light of its neighbours' either */
        return 0;
    if (least_height(d, packet, lane) > 0)
        return 1;
    float share = pen_trace_horizon_share(packet->cos_base[lane], packet->cos_a[lane],
        packet->cos_b[lane], d->emitter.type != PEN_TRACE_RECT);
    return d->emitter.type == PEN_TRACE_POINT ? 1 : fminf(4 * share, 1);
}

/* Sixteen receivers, by lane; those that there are not are turned from all light. */
struct block {
    uint32_t x, y; /* its first pixel */
    struct trace_receiver receivers[TRACE_LANES];
    bool is[TRACE_LANES];
    struct trace_packet packet;
};

static void load_block(struct denoise *d, uint32_t x0, uint32_t y0, struct block *b)
{
    uint32_t width = d->job->width, count = 0;
    memset(b->receivers, 0, sizeof b->receivers);
    b->x = x0;
    b->y = y0;
    for (uint32_t lane = 0; lane < TRACE_LANES; lane++) {
        uint32_t x = x0 + lane % BLOCK, y = y0 + lane / BLOCK;
        b->is[lane] = x < width && y < d->job->height &&
                      trace_receiver_read(
                          d->job, d->pieces.scene->extent, y * width + x, &b->receivers[lane]);
        count += b->is[lane];
    }
    trace_packet_load(&b->packet, &d->emitter, b->receivers, TRACE_LANES, 0, 0);
    atomic_fetch_add(&d->worked, count);
}

/* Beside what the pre-test finds mixed: one ray of each pixel may confirm what it says of the half. */
static bool is_as_half(struct denoise *d, struct block *b, uint32_t place, uint8_t verdict)
{
    struct trace_sums sums = {0};
    struct trace_block look = {d->look[0][place], d->look[1][place], 1};
    if (verdict == MIXED || verdict == NO_RECEIVER || d->samples == 1)
        return false;
    trace_packet_run(
        &d->emitter, &b->packet, &look, (d->mode & TRACE_SHARES) | TRACE_OWN_POINTS, &sums);
    atomic_fetch_add(&d->rays, sums.rays);
    for (uint32_t lane = 0; lane < TRACE_LANES; lane++) {
        if (!b->is[lane])
            continue;
        if (verdict == UMBRA ? sums.count[lane] || sums.visible[lane] > 0
                             : !sums.count[lane] || least_height(d, &b->packet, lane) <= 0)
            return false;
    }
    return true;
}

static void sample_block(struct denoise *d, uint32_t x0, uint32_t y0)
{
    static const float zero[3];
    struct block b;
    struct trace_sums sums = {0};
    uint32_t width = d->job->width, height = d->job->height;
    uint32_t place = (y0 / BLOCK & 1) * 2 + (x0 / BLOCK & 1), all = 4 * TRACE_LANES * d->samples;
    const int32_t *u = d->points + (size_t)place * TRACE_LANES * d->samples;
    struct trace_block block = {u, u + all, d->samples};
    uint8_t verdict = d->verdicts[denoise_half(d, x0, y0)];
    load_block(d, x0, y0, &b);
    bool same = is_as_half(d, &b, place, verdict);
    if (same)
        fill_block(d, x0, y0, verdict == UMBRA);
    else
        trace_packet_run(&d->emitter, &b.packet, &block, d->mode | TRACE_OWN_POINTS, &sums);
    for (uint32_t lane = 0; lane < TRACE_LANES; lane++) {
        uint32_t x = x0 + lane % BLOCK, y = y0 + lane / BLOCK, pixel = y * width + x;
        if (x >= width || y >= height)
            continue;
        d->above[pixel] = (uint8_t)(same ? d->samples : 0);
        d->fade[pixel] = b.is[lane] ? horizon_fade(d, &b.packet, lane) : 1;
        /* What is turned from the light says nothing of its neighbours: as what is no receiver. */
        set_normal(d, pixel, b.packet.active[lane] ? b.receivers[lane].normal : zero, 1);
        if (same)
            continue;
        set_value(d, pixel, b.is[lane] ? zero : d->mean_emission, b.is[lane] ? 0 : 1);
        if (!b.is[lane])
            continue;
        add_value(d, pixel, &sums, lane);
        d->above[pixel] = (uint8_t)sums.above[lane];
    }
    atomic_fetch_add(&d->rays, sums.rays);
}

void denoise_sample(void *context, uint32_t tile)
{
    struct denoise *d = context;
    uint32_t at[2];
    denoise_tile_at(d, tile, at);
    for (uint32_t y = at[1]; y < at[1] + TILE && y < d->job->height; y += BLOCK)
        for (uint32_t x = at[0]; x < at[0] + TILE && x < d->job->width; x += BLOCK) {
            uint32_t half = denoise_half(d, x, y);
            if (d->work[half] && !trace_is_late(&d->pieces))
                sample_block(d, x, y);
            else if (d->near[half])
                fill_block(d, x, y, d->verdicts[half] == UMBRA);
        }
}

void denoise_refine(void *context, uint32_t tile)
{
    struct denoise *d = context;
    struct trace_receiver receivers[TILE * TILE];
    struct trace_block block = {d->more_points, d->more_points + d->refine, d->refine};
    uint32_t at[2], count = 0, width = d->job->width, height = d->job->height;
    uint64_t rays = 0;
    denoise_tile_at(d, tile, at);
    for (uint32_t k = 0; k < TILE * TILE; k++) { /* block by block */
        uint32_t x = at[0] + k / 16 % 4 * BLOCK + k % 4, y = at[1] + k / 64 * BLOCK + k / 4 % 4;
        if (x < width && y < height && d->work[denoise_half(d, x, y)] && d->wanted[y * width + x])
            count += trace_receiver_read(
                d->job, d->pieces.scene->extent, y * width + x, &receivers[count]);
    }
    for (uint32_t first = 0; first < count && !trace_is_late(&d->pieces); first += TRACE_LANES) {
        uint32_t lanes = count - first < TRACE_LANES ? count - first : TRACE_LANES;
        struct trace_packet packet;
        struct trace_sums sums = {0};
        trace_packet_load(
            &packet, &d->emitter, receivers + first, lanes, d->job->seed, d->more_low_bits);
        trace_packet_run(&d->emitter, &packet, &block, d->mode, &sums);
        for (uint32_t lane = 0; lane < lanes; lane++)
            add_value(d, receivers[first + lane].pixel, &sums, lane);
        rays += sums.rays;
    }
    atomic_fetch_add(&d->rays, rays);
}
