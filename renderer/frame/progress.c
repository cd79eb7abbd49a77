#include "renderer/frame/progress.h"
#include "renderer/frame/needs.h"
#include "protocol/memory.h"
#include "renderer/passes/draw/kept_sums.h"
#include "renderer/passes/draw/screen.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#define SHARED_ROWS "renderer/shaders/frame/progress.def"
#include "renderer/shared/rows_c.h"

/* A sketch and its picture take up to two fifths of what a frame takes: of so many it is a tenth. */
#define SKETCH_FRAMES 4
#define LEAST_SHARE 0.03 /* of the render's time may go into estimates of its error */

static bool is_watched(const struct frame_progress *p)
{
    const struct pen_viewer *viewer = &p->job->viewer;
    return viewer->wants && viewer->wants(viewer->context);
}

void frame_progress_begin(
    struct frame_progress *p, const struct frame_job *job, uint32_t lights, uint32_t faces)
{
    *p = (struct frame_progress){.job = job,
        .lights = lights,
        .faces = faces,
        .begun_ms = gl_now_ms(),
        .standard_error = -1,
        .total = 1};
    p->tracked = frame_progress_is_limited(p) || is_watched(p);
}

bool frame_progress_wants_sketch(const struct frame_progress *p)
{
    const struct technique *technique = p->job->technique;
    const struct pen_request *r = p->job->request;
    return technique->sketch && technique->info.cost_class >= PEN_COST_HEAVY &&
           r->antialias >= SKETCH_FRAMES && frame_can_show(r) && is_watched(p);
}

bool frame_progress_is_limited(const struct frame_progress *p)
{
    return p->job->budget_ms > 0 || p->job->until_ms > 0;
}

double frame_progress_ms(const struct frame_progress *p)
{
    const struct technique_turns *turns = &p->job->ctx->turns;
    return turns->used_ms + gl_now_ms() - turns->since_ms;
}

void frame_progress_spent(struct frame_progress *p)
{
    double now = frame_progress_ms(p);
    p->last_extra_ms = now - p->step_ms;
    p->extra_ms += p->last_extra_ms;
    p->step_ms = now;
}

/* The next batch is taken for half again as long as the last, and what is left to do of the picture
 * for as long as all that came before the samples: geometry, and the sky's shadow. */
static bool is_time_up(const struct frame_progress *p, double now)
{
    const struct frame_job *job = p->job;
    double ahead = 1.5 * p->increment_ms + 1.2 * fmax(p->ahead_ms, p->last_extra_ms);
    double wall = gl_now_ms(), others = (wall - p->begun_ms) / fmax(now, 1e-3);
    return (job->budget_ms > 0 && now + ahead > job->budget_ms) ||
           (job->until_ms > 0 && wall + ahead * fmax(others, 1) > job->until_ms);
}

/* Lights, or faces of one, have unlike numbers of samples. */
static bool are_apart(const struct frame_progress *p)
{
    return p->units && !p->frames;
}

/* Units are sampled independently: variances of the mean add up. What is not known of one is taken
 * for the worst of the others. */
static float combine(const struct frame_progress *p)
{
    double worst = 0, sum = 0;
    for (uint32_t i = 0; i < p->units; i++)
        worst = fmax(worst, p->unit_squares[i]);
    for (uint32_t i = 0; i < p->units; i++) {
        bool whole = p->frames || i < p->unit;
        double samples = whole ? p->total : i == p->unit ? fmax(p->own, p->sketched) : p->sketched;
        double square = p->unit_squares[i];
        sum += (square > 0 ? square : worst) / samples;
    }
    return worst > 0 ? (float)sqrt(sum) : -1;
}

static bool has_error(const struct frame_progress *p)
{
    return are_apart(p) ? combine(p) >= 0 : p->standard_error >= 0;
}

/* An estimate of so many samples in all. */
static enum technique_step step(struct frame_progress *p, uint32_t samples)
{
    double now = frame_progress_ms(p);
    p->increment_ms = now - p->step_ms;
    p->step_ms = now;
    p->stopped = is_time_up(p, now);
    p->late = !p->begun && p->job->until_ms > 0 && gl_now_ms() > p->job->until_ms;
    p->begun = true;
    if (p->stopped)
        return STEP_STOP;
    const struct pen_viewer *viewer = &p->job->viewer;
    bool first = !p->shown && !p->kept_done;
    double share = fmax(viewer->share, LEAST_SHARE);
    /* More at the beginning, when there is most to see; in the end it is the share of all. */
    share *= sqrt((double)p->total * p->job->request->antialias / samples);
    bool owes = p->tracked && !has_error(p); /* however quick the samples are */
    if (!first && !owes && p->extra_ms + p->last_extra_ms > share * now)
        return STEP_GO_ON;
    p->show_wanted = is_watched(p);
    bool more = are_apart(p) ? p->kept_unit != p->unit || p->own >= 2 * p->kept_own
                             : samples >= 2 * p->kept_done;
    bool compare = p->tracked && more;
    return p->show_wanted || compare ? STEP_SHOW : STEP_GO_ON;
}

bool frame_progress_lower(const struct technique *technique, uint32_t *params)
{
    bool lowered = false;
    char name[32], value[32];
    int length = 0;
    for (const char *at = technique->sketch;
         at && sscanf(at, " %31[^=]=%31s%n", name, value, &length) == 2; at += length) {
        const struct pen_param *row = pen_param_find(technique->info.params, name);
        double most = strtod(value, NULL);
        if (row && pen_param_load(row, params, 0) > most)
            lowered |= pen_param_store(row, params, &most, "", NULL);
    }
    return lowered;
}

void frame_progress_sketched(struct frame_progress *p, double sketch_ms, bool on)
{
    struct technique_turns *turns = &p->job->ctx->turns;
    double now = frame_progress_ms(p), wall = gl_now_ms();
    double ahead = 1.2 * p->ahead_ms + 1.5 * sketch_ms, first = 1e-9;
    double others = fmax((wall - p->begun_ms) / fmax(now, 1e-3), 1);
    turns->stop_ms = turns->stop_used_ms = 0;
    p->begun |= on;
    if (on && p->job->budget_ms > 0)
        turns->stop_used_ms = fmax(p->job->budget_ms - ahead, first);
    if (on && p->job->until_ms > 0)
        turns->stop_ms = fmax(p->job->until_ms - ahead * others, first);
}

void frame_progress_sketch(struct frame_progress *p, uint32_t units, uint32_t samples)
{
    p->units = units;
    p->sketched = samples;
}

enum technique_step frame_progress_step(
    struct frame_progress *p, uint32_t unit, uint32_t done, uint32_t total)
{
    p->total = total;
    p->done = done;
    p->unit = unit;
    p->own = done;
    if (p->units) {
        double sum = (double)unit * total + fmax(done, p->sketched) +
                     (double)(p->units - unit - 1) * p->sketched;
        p->done = (uint32_t)(sum / p->units);
    }
    /* What there was of this light before was better. */
    if (done < p->sketched)
        return STEP_GO_ON;
    if (done == total) {
        /* What the next one is compared with. */
        p->show_wanted = false;
        return p->tracked && are_apart(p) && unit + 1 < p->units ? STEP_SHOW : STEP_GO_ON;
    }
    return step(p, p->frames * total + p->done);
}

enum technique_step frame_progress_next(struct frame_progress *p)
{
    if (p->stopped)
        return STEP_STOP;
    p->frames++;
    p->done = 0;
    if (p->units && p->frames == 1) {
        p->standard_error = combine(p);
        p->kept_done = 0;
    }
    return p->frames < p->job->request->antialias ? step(p, p->frames * p->total) : STEP_GO_ON;
}

static bool draw(const struct frame_progress *p, uint32_t to, const struct pass_texture *textures,
    uint32_t texture_count, const char *name, const struct progress_block *block,
    struct pen_error *error)
{
    struct frame_targets *t = p->job->targets;
    bool spread = to == FRAME_MEANS;
    const struct gl_target *target = spread ? &t->spread : &t->means[to];
    return pass_fill(p->job->ctx,
        &(struct pass_fill){.name = name,
            .fragment = "progress.frag",
            .defines = spread ? "#define SPREAD\n" : NULL,
            .stage = PEN_STAGE_SHADE,
            .textures = textures,
            .texture_count = texture_count,
            .framebuffer = target->framebuffer,
            .width = target->texture.width,
            .height = target->texture.height,
            .extra = block,
            .extra_bytes = sizeof *block},
        error);
}

/* Of two estimates of which the later contains the earlier, n of m samples, the difference has the
 * variance s^2 (1/n - 1/m), and the later itself s^2 / m: two batch means (W. Cochran, Sampling
 * Techniques, 3rd ed., section 2.15: two random groups). Nets do better than independent samples, so
 * that this errs on the side of too large. */
static bool estimate(
    struct frame_progress *p, uint32_t kept, uint32_t samples, struct pen_error *error)
{
    const struct pen_request *r = p->job->request;
    struct frame_targets *t = p->job->targets;
    uint32_t width = (r->width + PROGRESS_TILE - 1) / PROGRESS_TILE;
    uint32_t height = (r->height + PROGRESS_TILE - 1) / PROGRESS_TILE;
    gl_target_fit(&t->spread, GL_RG32F, width, height, 0, 1);
    struct progress_block block = {{0}};
    struct pass_texture textures[] = {
        {UNIT_DEPTH, t->gbuffer.depth.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_MEAN, t->means[p->now].texture.name, GL_SAMPLE_NEAREST},
        {UNIT_MEAN_BEFORE, t->means[p->kept].texture.name, GL_SAMPLE_NEAREST}};
    if (!draw(p, FRAME_MEANS, textures, 3, "spread", &block, error))
        return false;
    float *sums = pen_alloc((size_t)width * height, 2 * sizeof *sums);
    gl.BindFramebuffer(GL_FRAMEBUFFER, t->spread.framebuffer);
    gl.PixelStorei(GL_PACK_ALIGNMENT, 1);
    gl.ReadPixels(0, 0, (GLsizei)width, (GLsizei)height, GL_RG, GL_FLOAT, sums);
    double squares = 0, pixels = 0;
    for (size_t i = 0; i < (size_t)width * height; i++) {
        squares += (double)sums[2 * i];
        pixels += (double)sums[2 * i + 1];
    }
    free(sums);
    double share = (double)kept / (samples - kept);
    double square = pixels > 0 ? squares / pixels * share : 0;
    if (are_apart(p))
        p->unit_squares[p->unit] = square * samples;
    else
        p->standard_error = (float)sqrt(square);
    return true;
}

bool frame_progress_compare(struct frame_progress *p, struct pen_error *error)
{
    const struct pen_request *r = p->job->request;
    struct frame_targets *t = p->job->targets;
    uint32_t samples = p->frames * p->total + p->done, next = 0;
    bool apart = are_apart(p);
    if (samples == p->now_done)
        return true;
    if (apart && p->kept_done && p->kept_unit != p->unit) {
        p->kept = p->now;
        p->kept_done = p->now_done;
        p->kept_own = p->sketched;
        p->kept_unit = p->unit;
    }
    while ((p->now_done && next == p->now) || (p->kept_done && next == p->kept))
        next++;
    gl_target_fit(&t->means[next], GL_R32F, r->width, r->height, 0, 1);
    /* Of jittered frames the mean of all. */
    float weight = p->frames > 1 && p->now_done ? 1 / (float)p->frames : 1;
    struct progress_block block = {
        .mean = {(float)p->lights, weight, p->lights ? 1 / (float)p->lights : 1}};
    struct pass_texture textures[] = {{UNIT_SOURCE, t->vis.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_MEAN_BEFORE, t->means[p->now].texture.name, GL_SAMPLE_NEAREST}};
    if (!draw(p, next, textures, 2, "mean", &block, error))
        return false;
    p->now = next;
    p->now_done = samples;
    uint32_t own = apart ? p->own : samples, kept = apart ? p->kept_own : p->kept_done;
    if (p->kept_done && own > kept && !estimate(p, kept, own, error))
        return false;
    if (!p->kept_done || own >= 2 * kept) {
        p->kept = p->now;
        p->kept_done = samples;
        p->kept_own = own;
        p->kept_unit = p->unit;
    }
    return true;
}

void frame_progress_tell(struct frame_progress *p, struct pen_result *result)
{
    uint32_t total = p->total * p->job->request->antialias;
    result->progress = (struct pen_progress){.number = p->shown++,
        .done = p->frames * p->total + p->done,
        .total = total,
        .kept = p->faces ? (uint32_t)(kept_sums_taken(p->job->sums) / p->faces) : 0,
        .standard_error = are_apart(p) ? combine(p) : p->standard_error,
        .elapsed_ms = (float)(gl_now_ms() - p->begun_ms)};
}

void frame_progress_end(struct frame_progress *p, struct pen_result *result)
{
    frame_progress_tell(p, result);
    if (p->stopped && !result->progress.done)
        pen_result_warn(result, "Its time was up: the shadows are a sketch (%s at most).",
            p->job->technique->sketch);
    else if (p->stopped)
        pen_result_warn(result, "Its time was up: the picture rests on %u of %u samples.",
            result->progress.done, result->progress.total);
}
