#include "renderer/frame/progress.h"
#include "protocol/memory.h"
#include "renderer/passes/draw/kept_sums.h"
#include "renderer/passes/draw/screen.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#define SHARED_ROWS "renderer/shaders/frame/progress.def"
#include "renderer/shared/rows_c.h"

#define LEAST_SHARE 0.03 /* of the render's time may go into estimates of its error */

void frame_progress_begin(
    struct frame_progress *p, const struct frame_job *job, uint32_t lights, uint32_t faces)
{
    *p = (struct frame_progress){.job = job,
        .lights = lights,
        .faces = faces,
        .begun_ms = gl_now_ms(),
        .standard_error = -1,
        .total = 1};
    p->tracked = frame_progress_is_limited(p) ||
                 (job->viewer.wants && job->viewer.wants(job->viewer.context));
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
    if (!first && p->extra_ms + p->last_extra_ms > share * now)
        return STEP_GO_ON;
    p->show_wanted = viewer->wants && viewer->wants(viewer->context);
    bool compare = p->tracked && samples >= 2 * p->kept_done;
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
    if (p->units) {
        double sum = (double)unit * total + fmax(done, p->sketched) +
                     (double)(p->units - unit - 1) * p->sketched;
        p->done = (uint32_t)(sum / p->units);
    }
    /* What there was of this light before was better. */
    if (done == total || done < p->sketched)
        return STEP_GO_ON;
    return step(p, p->frames * total + p->done);
}

enum technique_step frame_progress_next(struct frame_progress *p)
{
    if (p->stopped)
        return STEP_STOP;
    p->frames++;
    p->done = 0;
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
static bool estimate(struct frame_progress *p, struct pen_error *error)
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
    double share = (double)p->kept_done / (p->now_done - p->kept_done);
    p->standard_error = pixels > 0 ? (float)sqrt(squares / pixels * share) : 0;
    return true;
}

bool frame_progress_compare(struct frame_progress *p, struct pen_error *error)
{
    const struct pen_request *r = p->job->request;
    struct frame_targets *t = p->job->targets;
    uint32_t samples = p->frames * p->total + p->done, next = 0;
    if (samples == p->now_done)
        return true;
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
    if (p->kept_done && !estimate(p, error))
        return false;
    if (samples >= 2 * p->kept_done) {
        p->kept = p->now;
        p->kept_done = samples;
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
        /* Lights of unlike numbers of samples: what moves least may be what is farthest off. */
        .standard_error = p->units ? -1 : p->standard_error,
        .elapsed_ms = (float)(gl_now_ms() - p->begun_ms)};
}
