#include "server/auto/render.h"
#include "protocol/memory.h"
#include "server/auto/calibration.h"
#include "server/base/clock.h"
#include "server/queue/compare.h"
#include "server/base/log.h"
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define REFERENCE_SETTINGS "samples=1024"
#define GPU_PIXELS (320u * 240u)      /* of the pictures whose error is measured */
#define SOFTWARE_PIXELS (176u * 132u) /* the same, and of those that are timed */
#define TIMED_PIXELS (2u << 20)       /* at most, on a GPU */
#define COLD 3 /* renders that make their shadow inputs anew; they give the error too */
#define REPEATS 5
#define STEPS (COLD + REPEATS) /* of one candidate */
#define SLOW_MS 400            /* a candidate that takes longer is timed once in either way */
#define PATIENCE_MS 120000
#define MAX_RUNS 4 /* at the same time */
#define PROBES 3   /* of the G-buffer at PROBE_SCALE times as many pixels */
#define PROBE_SCALE 4
#define MAX_STEPS (1 + AUTO_MAX_ROWS * STEPS + PROBES)

/* One scene and view being measured, and the renders that wait for it. */
struct run {
    struct run *next;
    struct auto_runs *runs;
    struct pen_device_info device;
    uint8_t scene[PEN_ID_BYTES];
    struct auto_table table;
    struct auto_render *waiting;          /* guarded by auto_runs.lock */
    uint32_t steps, probes, probe_pixels; /* probes: the first of them; none: steps */
    struct pen_request requests[MAX_STEPS];
    uint32_t measures[MAX_STEPS];
};

struct auto_runs {
    struct auto_parts parts; /* constant */
    pthread_mutex_t lock;    /* guards the runs and the renders that wait */
    struct run *first;
    pthread_mutex_t saving; /* held while the store's tables are written */
    struct auto_history *history;
};

struct auto_runs *auto_runs_create(const struct auto_parts *parts)
{
    struct auto_runs *runs = pen_alloc_zero(1, sizeof *runs);
    pthread_mutex_init(&runs->lock, NULL);
    pthread_mutex_init(&runs->saving, NULL);
    runs->parts = *parts;
    runs->history = auto_history_create();
    return runs;
}

void auto_runs_destroy(struct auto_runs *runs)
{
    if (!runs)
        return;
    auto_history_destroy(runs->history);
    pthread_mutex_destroy(&runs->saving);
    pthread_mutex_destroy(&runs->lock);
    free(runs);
}

void auto_runs_observe(struct auto_runs *runs, const struct auto_render *render, double ms)
{
    auto_history_add(runs->history, &render->expected, ms);
}

/* ---- choosing ---- */

/* Takes a method from the table. */
static bool take(struct auto_runs *runs, struct auto_render *render,
    const struct auto_table *measured, struct pen_error *error)
{
    struct auto_table corrected = *measured, *table = &corrected;
    struct auto_expected expected[AUTO_MAX_ROWS];
    double factors[AUTO_MAX_ROWS];
    struct auto_wish wish;
    struct auto_pick pick;
    struct pen_request *request = render->request;
    for (uint32_t i = 0; i < table->count; i++) { /* times as other renders have borne them out */
        auto_history_name(
            table->cost, table->rows[i].key, request->width, request->height, &expected[i]);
        factors[i] = auto_history_factor(runs->history, &expected[i]);
        table->rows[i].fixed_ms *= factors[i];
        table->rows[i].screen_ms *= factors[i];
    }
    memcpy(&wish, request->technique_params, sizeof wish);
    if (!auto_choose(table, &wish, (uint64_t)request->width * request->height, &pick) ||
        !auto_apply(pick.row->key, runs->parts.catalogue, request))
        return pen_fail(
            error, PEN_INTERNAL, "/technique", "No method could be measured on this scene.");
    snprintf(render->why, sizeof render->why, "%s", pick.why);
    render->met = pick.met;
    render->expected = expected[pick.row - table->rows];
    render->expected.ms = pick.predicted_ms / factors[pick.row - table->rows];
    return true;
}

/* ---- measuring ---- */

static void limit_pixels(struct pen_request *request, uint32_t most)
{
    double scale = sqrt((double)most / ((double)request->width * request->height));
    if (scale >= 1)
        return;
    request->width = (uint32_t)fmax(1, round(request->width * scale));
    request->height = (uint32_t)fmax(1, round(request->height * scale));
}

static void add_step(struct run *run, const struct pen_request *request, uint32_t measure)
{
    run->requests[run->steps] = *request;
    run->measures[run->steps++] = measure;
}

/* The G-buffer's time is mostly that of triangles: where times are taken of a smaller picture than
 * was asked for, a second size tells how much of it grows with the pixels. */
static void plan_probes(struct run *run, const struct pen_request *asked)
{
    struct pen_request larger = *asked;
    if ((uint64_t)asked->width * asked->height <= run->table.pixels || !run->table.count)
        return;
    limit_pixels(&larger, PROBE_SCALE * run->table.pixels);
    auto_apply(run->table.rows[0].key, run->runs->parts.catalogue, &larger);
    run->probe_pixels = larger.width * larger.height;
    for (int k = 0; k < PROBES; k++)
        add_step(run, &larger, MEASURE_PICTURE);
}

/* The reference, then every candidate: its error, and its time a few times; then the probes. */
static void plan_steps(struct run *run, const struct pen_request *asked)
{
    const struct pen_catalogue *catalogue = run->runs->parts.catalogue;
    bool software = run->device.software, textured = false;
    struct pen_request small = *asked, timed = *asked;
    char keys[AUTO_MAX_ROWS][AUTO_KEY_BYTES];
    limit_pixels(&small, software ? SOFTWARE_PIXELS : GPU_PIXELS);
    limit_pixels(&timed, software ? SOFTWARE_PIXELS : TIMED_PIXELS);
    run->table.pixels = timed.width * timed.height;
    small.output.format = PEN_PNG;
    small.output.layer = PEN_LAYER_BEAUTY;
    small.output.bit_depth = 0;
    if (!auto_apply("raytraced " REFERENCE_SETTINGS, catalogue, &small))
        auto_apply("multisample " REFERENCE_SETTINGS, catalogue, &small);
    add_step(run, &small, MEASURE_REFERENCE);
    for (uint32_t i = 0; i < asked->light_count; i++)
        textured |= asked->lights[i].texture != PEN_TEXTURE_NONE;
    run->table.count = auto_candidates(catalogue, textured, software, keys);
    for (uint32_t i = 0; i < run->table.count; i++) {
        memcpy(run->table.rows[i].key, keys[i], AUTO_KEY_BYTES);
        auto_apply(keys[i], catalogue, &small);
        auto_apply(keys[i], catalogue, &timed);
        for (int k = 0; k < COLD; k++)
            add_step(run, &small, MEASURE_NUMBERS);
        for (int k = 0; k < REPEATS; k++)
            add_step(run, &timed, MEASURE_PICTURE);
    }
    run->probes = run->steps;
    plan_probes(run, asked);
}

static int compare_floats(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static double screen_ms(const struct pen_result *result)
{
    static const enum pen_stage stages[] = {PEN_STAGE_GBUFFER, PEN_STAGE_TECHNIQUE, PEN_STAGE_SHADE,
        PEN_STAGE_READBACK, PEN_STAGE_ENCODE};
    double ms = 0;
    for (size_t i = 0; i < sizeof stages / sizeof *stages; i++)
        ms += result->stage_ms[stages[i]];
    return ms;
}

/* The median of one stage over some steps; 0 when none of them went well. */
static double median_ms(const struct compare_row *steps, int count, enum pen_stage stage)
{
    float ms[STEPS];
    int good = 0;
    for (int k = 0; k < count; k++)
        if (steps[k].result.error.code == PEN_OK && steps[k].run_ms > 0)
            ms[good++] = steps[k].result.stage_ms[stage];
    qsort(ms, (size_t)good, sizeof *ms, compare_floats);
    return good ? (double)ms[good / 2] : 0;
}

/* What of the G-buffer's time at table.pixels does not grow with them. */
static double geometry_ms(const struct run *run, const struct compare_row *steps)
{
    if (run->probes == run->steps)
        return 0;
    double small = median_ms(&steps[1 + COLD], REPEATS, PEN_STAGE_GBUFFER);
    double large = median_ms(&steps[run->probes], PROBES, PEN_STAGE_GBUFFER);
    double per_pixel = (large - small) / ((double)run->probe_pixels - run->table.pixels);
    return large > 0 ? fmax(small - fmax(per_pixel, 0) * run->table.pixels, 0) : 0;
}

/* The row of one candidate from its steps; false when it could not be measured. Of the repeats the
 * second slowest counts, near what nineteen of twenty stay below; the slowest is the one that met a
 * program for the first time. They find their shadow inputs kept, which a request with another
 * light does not: what these cost, the median because the first one may have compiled programs, is
 * added. `geometry`: geometry_ms. */
static bool read_row(const struct compare_row *steps, double geometry, struct auto_row *row)
{
    const struct compare_row *slowest = NULL, *second = NULL;
    if (steps[0].result.error.code != PEN_OK || !(steps[0].run_ms > 0))
        return false;
    for (int k = COLD; k < STEPS; k++) {
        const struct compare_row *step = &steps[k];
        if (step->result.error.code != PEN_OK || !(step->run_ms > 0))
            continue;
        if (!slowest || step->run_ms > slowest->run_ms) {
            second = slowest;
            slowest = step;
        } else if (!second || step->run_ms > second->run_ms)
            second = step;
    }
    const struct compare_row *typical = second ? second : slowest;
    if (!typical)
        return false;
    row->rmse = steps[0].result.comparison.rmse;
    const float *stage_ms = typical->result.stage_ms;
    double screen = fmin(screen_ms(&typical->result), typical->run_ms);
    double rest = typical->run_ms - screen;
    geometry = fmin(geometry, fmin((double)stage_ms[PEN_STAGE_GBUFFER], screen));
    row->screen_ms = screen - geometry;
    row->fixed_ms = geometry + rest - fmin((double)stage_ms[PEN_STAGE_SHADOW], rest) +
                    median_ms(steps, COLD, PEN_STAGE_SHADOW);
    return true;
}

static void read_rows(struct run *run, const struct compare_row *steps)
{
    uint32_t candidates = run->table.count;
    double geometry = geometry_ms(run, steps);
    run->table.count = 0;
    for (uint32_t i = 0; i < candidates; i++) {
        struct auto_row row = run->table.rows[i];
        if (read_row(&steps[1 + i * STEPS], geometry, &row))
            run->table.rows[run->table.count++] = row;
    }
}

/* Ends the renders whose time is up; the run goes on for the next ones. */
static void expire(struct run *run)
{
    struct auto_runs *runs = run->runs;
    struct auto_render *late = NULL;
    struct pen_error error = {0};
    uint64_t now = clock_now_ns();
    pthread_mutex_lock(&runs->lock);
    for (struct auto_render **at = &run->waiting; *at;) {
        struct auto_render *render = *at;
        if (render->deadline_ns > now) {
            at = &render->next;
            continue;
        }
        *at = render->next;
        render->next = late;
        late = render;
    }
    pthread_mutex_unlock(&runs->lock);
    pen_fail(&error, PEN_DEADLINE, "/deadline_ms",
        "The scene is still being measured: ask again, or allow more time.");
    while (late) {
        struct auto_render *render = late;
        late = render->next;
        render->chosen(render, &error);
    }
}

/* Leaves out what a slow candidate's first pictures have told already. */
static bool wants(void *owner, struct compare *compare, uint32_t step)
{
    struct run *run = owner;
    const struct compare_row *rows = compare_rows(compare);
    uint32_t repeat = (step - 1) % STEPS, first = step - repeat;
    expire(run);
    if (step >= run->probes)
        return true;
    if (repeat && rows[first].result.error.code != PEN_OK)
        return false;
    if (repeat < COLD)
        return !repeat || rows[first].run_ms < SLOW_MS;
    return repeat < COLD + 2 || rows[first + COLD].run_ms < SLOW_MS;
}

/* A scene that was deleted meanwhile has no place for it; those who wait are served all the same. */
static void save(struct run *run)
{
    struct auto_runs *runs = run->runs;
    if (!run->table.count)
        return;
    pthread_mutex_lock(&runs->saving);
    bool ok = calibration_save(runs->parts.store, run->scene, &run->device, &run->table);
    pthread_mutex_unlock(&runs->saving);
    if (!ok)
        log_event(LOG_ERROR, "a calibration could not be written to the store");
}

/* Any thread. */
static void done(void *owner, struct compare *compare, const struct pen_error *error)
{
    struct run *run = owner;
    struct auto_runs *runs = run->runs;
    if (error->code == PEN_OK) {
        read_rows(run, compare_rows(compare));
        save(run);
    }
    compare_destroy(compare);
    pthread_mutex_lock(&runs->lock);
    struct run **at = &runs->first;
    while (*at != run)
        at = &(*at)->next;
    *at = run->next;
    pthread_mutex_unlock(&runs->lock);
    expire(run);
    while (run->waiting) { /* nobody can join any more */
        struct auto_render *render = run->waiting;
        struct pen_error own = *error;
        run->waiting = render->next;
        if (own.code == PEN_OK)
            take(runs, render, &run->table, &own);
        render->chosen(render, &own);
    }
    free(run);
}

static void start(struct run *run)
{
    struct compare_plan plan = {.requests = run->requests,
        .count = run->steps,
        .measures = run->measures,
        .patience_ms = PATIENCE_MS,
        .wants = wants,
        .done = done,
        .owner = run};
    struct pen_error error = {0};
    if (compare_start(run->runs->parts.scheduler, &plan, &error))
        return;
    done(run, NULL, &error);
}

/* What the request's measurements are filed under. */
static void name_setup(const struct auto_render *render, struct auto_table *table)
{
    memset(table, 0, sizeof *table);
    calibration_setup(render->request, table->setup, table->cost);
}

bool auto_runs_recall(struct auto_runs *runs, const struct pen_device_info *device,
    struct auto_render *render, struct pen_error *error)
{
    struct auto_wish wish;
    struct auto_table table;
    memcpy(&wish, render->request->technique_params, sizeof wish);
    name_setup(render, &table);
    /* An error is known only of a view that was measured; a time nearly holds for others too. */
    bool any = wish.budget_ms > 0 && !(wish.max_rmse > 0);
    return calibration_load(runs->parts.store, render->request->scene, device, any, &table) &&
           take(runs, render, &table, error);
}

bool auto_runs_measure(struct auto_runs *runs, const struct pen_device_info *device,
    struct auto_render *render, struct pen_error *error)
{
    struct auto_table wanted;
    struct run *fresh = pen_alloc_zero(1, sizeof *fresh);
    name_setup(render, &wanted);
    pthread_mutex_lock(&runs->lock);
    struct run *run = runs->first;
    uint32_t count = 0;
    while (run && (memcmp(run->scene, render->request->scene, PEN_ID_BYTES) ||
                      memcmp(run->table.setup, wanted.setup, PEN_ID_BYTES))) {
        run = run->next;
        count++;
    }
    bool full = !run && count >= MAX_RUNS;
    bool starts = !run && !full;
    if (starts) {
        run = fresh;
        run->runs = runs;
        run->device = *device;
        memcpy(run->scene, render->request->scene, PEN_ID_BYTES);
        run->table = wanted;
        plan_steps(run, render->request);
        run->next = runs->first;
        runs->first = run;
    }
    if (!full) {
        render->next = run->waiting;
        run->waiting = render;
    }
    pthread_mutex_unlock(&runs->lock);
    if (starts)
        start(run);
    else
        free(fresh);
    if (!full)
        return true;
    pen_fail(error, PEN_UNAVAILABLE, "", "%d scenes are being measured already.", MAX_RUNS);
    error->retry_after_s = 2;
    return false;
}
