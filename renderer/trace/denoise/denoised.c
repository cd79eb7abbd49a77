/* The stages of a job, and its memory. */
#include "renderer/trace/denoise/internal.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define SPREAD 1     /* halves around what the pre-test finds mixed */
#define LEAST_MORE 4 /* rays: fewer are not worth their time */
#define ROWS 256u    /* of an emission texture that are looked at, and twice as many columns */

/* Consecutive beginnings of one well-spread sequence for the pixels of a half in Morton order, so that
 * wherever a filter looks the points of its pixels are well spread. Those of a pixel are sorted by
 * strata: ray i of all pixels aims at the same. */
static void make_points(struct denoise *d, uint32_t seed)
{
    uint32_t n = d->samples, bits = 0, all = 4 * TRACE_LANES * n;
    while ((1u << bits) < n)
        bits++;
    uint32_t x_bits = (bits + 1) / 2, y_bits = bits / 2;
    for (uint32_t k = 0; k < HALF * HALF; k++) {
        uint32_t x = k % HALF, y = k / HALF, morton = 0;
        for (uint32_t b = 0; b < 3; b++)
            morton |= (x >> b & 1) << 2 * b | (y >> b & 1) << (2 * b + 1);
        uint32_t place = y / BLOCK * 2 + x / BLOCK, lane = y % BLOCK * BLOCK + x % BLOCK;
        for (uint32_t i = 0; i < n; i++) {
            uint32_t u, v;
            trace_sample_at(morton * n + i, seed, &u, &v);
            uint32_t stratum = (uint32_t)((uint64_t)u >> (32 - x_bits)) << y_bits |
                               (uint32_t)((uint64_t)v >> (32 - y_bits));
            uint32_t at = (place * n + stratum) * TRACE_LANES + lane;
            d->points[at] = (int32_t)(u ^ 0x80000000u);
            d->points[all + at] = (int32_t)(v ^ 0x80000000u);
            if (stratum != morton % n)
                continue;
            d->look[0][place][lane] = d->points[at];
            d->look[1][place][lane] = d->points[all + at];
        }
    }
}

static bool make_more_points(struct denoise *d, struct pen_error *error)
{
    uint32_t n = d->refine, bits = 0;
    uint32_t *u = (uint32_t *)d->more_points, *v = u + n;
    if (!trace_samples_net(0, n, ~d->job->seed, u, v))
        return pen_fail(error, PEN_UNAVAILABLE, "", "Out of memory.");
    for (uint32_t i = 0; i < 2 * n; i++)
        u[i] ^= 0x80000000u;
    while ((2u << bits) <= n)
        bits++;
    d->more_low_bits = 0xffffffffu >> bits / 2;
    return true;
}

/* Of the light's width: one over how often its picture goes from dark to light and back, at most. */
static float smallest_feature(const struct trace_emitter *e)
{
    uint32_t step_x = e->columns / (2 * ROWS) + 1, step_y = e->rows / ROWS + 1;
    float low = INFINITY, high = 0, most = 0;
    for (int axis = 0; axis < 2; axis++) {
        uint32_t lines = axis ? e->columns : e->rows, line_step = axis ? step_x : step_y;
        uint32_t along = axis ? e->rows : e->columns, step = axis ? step_y : step_x;
        for (uint32_t line = 0; line < lines; line += line_step) {
            float sum = 0, last = 0;
            for (uint32_t i = 0; i < along; i += step) {
                size_t at = axis ? (size_t)i * e->columns + line : (size_t)line * e->columns + i;
                const float *rgb = e->emission + 4 * at;
                float now = rgb[0] + rgb[1] + rgb[2];
                sum += i ? fabsf(now - last) : 0;
                last = now;
                low = fminf(low, now);
                high = fmaxf(high, now);
            }
            most = fmaxf(most, sum);
        }
    }
    return high > low ? 1 / (1 + most / (high - low)) : 1;
}

/* Around what the pre-test finds mixed, and where lit halves are beside umbra. */
static bool find_work(struct denoise *d)
{
    uint32_t halves = d->halves_x * d->halves_y;
    memset(d->work, 0, halves);
    memset(d->near, 0, halves);
    if (!trace_verdicts_spread(d->verdicts, d->halves_x, d->halves_y, SPREAD, d->work))
        return false;
    for (uint32_t i = 0; i < halves; i++)
        d->marks[i] = d->work[i] ? MIXED : NO_RECEIVER;
    return trace_verdicts_spread(d->marks, d->halves_x, d->halves_y, SPREAD, d->near);
}

/* Hands out the room in pieces of whole cache lines. */
static size_t place(uint8_t *room, size_t *used, size_t bytes, void *pointer)
{
    if (room) {
        void *at = room + *used;
        memcpy(pointer, &at, sizeof at);
    }
    return *used += (bytes + 63) & ~(size_t)63;
}

static size_t lay_out(struct denoise *d, uint8_t *room)
{
    size_t used = 0, pixels = (size_t)d->job->width * d->job->height;
    size_t halves = (size_t)d->halves_x * d->halves_y, blocks = (size_t)d->blocks_x * d->blocks_y;
    place(room, &used, 2 * 4 * TRACE_LANES * sizeof(int32_t) * d->samples, &d->points);
    place(room, &used, 2 * sizeof(int32_t) * (d->how->refine + 1) * 2, &d->more_points);
    place(room, &used, halves, &d->verdicts);
    place(room, &used, blocks * sizeof *d->reach, &d->reach);
    place(room, &used, halves, &d->marks);
    place(room, &used, halves, &d->work);
    place(room, &used, halves, &d->near);
    place(room, &used, blocks, &d->radius);
    for (int k = 0; k < 2; k++)
        place(room, &used, pixels * d->parts * sizeof(float), &d->value[k]);
    place(room, &used, pixels * sizeof *d->fade, &d->fade);
    place(room, &used, pixels * sizeof *d->above, &d->above);
    place(room, &used, pixels, &d->wanted);
    return place(room, &used, pixels * sizeof *d->normals, &d->normals);
}

/* As many more rays for each as the budget allows: any beginning of the sequence is well spread. */
static void keep_budget(struct denoise *d)
{
    double narrow = (double)atomic_load(&d->narrow);
    double each = (double)d->how->budget * d->job->width * d->job->height / fmax(narrow, 1);
    uint32_t most = d->how->refine && narrow > 0 ? trace_points_round(d->how->refine) : 0;
    d->refine = each < most ? (uint32_t)each : most;
    d->capped = d->refine < most && d->refine < LEAST_MORE;
    if (d->capped)
        d->refine = 0;
}

static bool run_stages(struct denoise *d, struct pen_error *error)
{
    struct trace_pieces *p = &d->pieces;
    if (!trace_in_pieces(p, d->tiles, denoise_pretest))
        goto late;
    if (!find_work(d))
        return pen_fail(error, PEN_UNAVAILABLE, "", "Out of memory.");
    if (!trace_in_pieces(p, d->tiles, denoise_sample) ||
        !trace_in_pieces(p, d->tiles, denoise_plan))
        goto late;
    keep_budget(d);
    if (d->refine && !make_more_points(d, error))
        return false;
    if ((!d->refine || trace_in_pieces(p, d->tiles, denoise_refine)) &&
        trace_in_pieces(p, d->tiles, denoise_filter_x) &&
        trace_in_pieces(p, d->tiles, denoise_filter_y))
        return true;
late:
    return pen_fail(error, PEN_DEADLINE, "", "The deadline passed while rays were traced.");
}

static void measure(struct denoise *d, const struct pen_trace_light *light)
{
    const float *down = d->job->view->down, *half = d->emitter.half;
    d->parts = d->mode & TRACE_COLOUR ? 4 : 1;
    d->tiles_x = (d->job->width + TILE - 1) / TILE;
    d->tiles = d->tiles_x * ((d->job->height + TILE - 1) / TILE);
    d->halves_x = (d->job->width + HALF - 1) / HALF;
    d->halves_y = (d->job->height + HALF - 1) / HALF;
    d->blocks_x = (d->job->width + BLOCK - 1) / BLOCK;
    d->blocks_y = (d->job->height + BLOCK - 1) / BLOCK;
    d->pixel = sqrtf(trace_dot(down, down));
    d->size = 2 * fminf(half[0], half[1]);
    if (light->emission)
        d->size *= smallest_feature(&d->emitter);
}

static bool check(const struct pen_trace_light *light, const struct pen_trace_job *job,
    const struct pen_trace_denoising *how, struct pen_error *error)
{
    if (!trace_job_check(light, job, error))
        return false;
    if (!job->view || job->samples > DENOISED_SAMPLES || how->refine > DENOISED_REFINE)
        return pen_fail(error, PEN_INVALID, "", "There is no view, or there are too many rays.");
    return true;
}

bool pen_trace_denoised(struct pen_trace_scene *scene, const struct pen_trace_light *light,
    const struct pen_trace_job *job, const struct pen_trace_denoising *how, uint16_t *halves,
    struct pen_trace_stats *stats, struct pen_error *error)
{
    double start = trace_seconds();
    struct denoise d = {
        .pieces = {.scene = scene, .job = job}, .job = job, .how = how, .halves = halves};
    struct pen_trace_denoising none = {0};
    uint8_t *room = NULL;
    bool ok = false;
    if (!check(light, job, how, error))
        return false;
    d.emitter = trace_emitter_of(light);
    d.samples = trace_points_round(job->samples);
    if (light->type == PEN_TRACE_POINT) { /* all rays are alike */
        d.samples = 1;
        d.how = &none;
    }
    d.mode = (d.emitter.emission ? TRACE_COLOUR : 0) | (scene->alpha.blends ? TRACE_SHARES : 0);
    measure(&d, light);
    struct trace_silhouette silhouette = {.shape = TRACE_BOTH_SIDES};
    if (job->front_only)
        silhouette = trace_silhouette_of(&d.emitter);
    uint64_t builds = scene->builds;
    const struct trace_hierarchy *hierarchy = trace_hierarchy_get(scene, &silhouette, job, error);
    if (!hierarchy)
        return false;
    double build_seconds = scene->builds != builds ? trace_seconds() - start : 0;
    start = trace_seconds();
    d.emitter.scene = hierarchy->scene;
    d.pieces.threads = trace_thread_count(job->threads);
    size_t bytes = lay_out(&d, NULL);
    room = trace_scratch_take(scene, &bytes);
    if (!room) {
        pen_fail(error, PEN_UNAVAILABLE, "", "Out of memory.");
        goto fail;
    }
    lay_out(&d, room);
    make_points(&d, job->seed);
    ok = trace_emitter_average(&d.emitter, d.mean_emission, error);
    for (int c = 0; c < 4; c++)
        d.lit[c] = pen_trace_half(c < 3 ? d.mean_emission[c] : 1);
    ok = ok && run_stages(&d, error);
    if (ok && stats) {
        double seconds = trace_seconds() - start;
        *stats = (struct pen_trace_stats){.rays = d.rays,
            .full_receivers = d.worked,
            .build_seconds = build_seconds,
            .casters = hierarchy->triangles,
            .filtered = hierarchy->filtered,
            .seconds = seconds,
            .cpu_seconds = d.pieces.cpu_seconds,
            .mrays_per_second = (double)d.rays / seconds * 1e-6,
            .samples = d.samples,
            .threads = d.pieces.threads};
    }
fail:
    trace_scratch_give(scene, room, bytes);
    trace_hierarchy_release(scene, hierarchy);
    return ok;
}
