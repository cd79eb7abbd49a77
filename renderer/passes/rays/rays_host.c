/* Rays on the CPU: read depths and normals back, trace, upload what is visible. */
#include "protocol/container.h"
#include "protocol/memory.h"
#include "renderer/passes/draw/kept_sums.h"
#include "renderer/passes/draw/show.h"
#include "renderer/passes/draw/turn.h"
#include "renderer/passes/rays/host_picture.h"
#include "renderer/passes/rays/rays.h"
#include "renderer/trace/denoise/denoised.h"
#include "renderer/trace/points.h"
#include <stdlib.h>
#include <string.h>

/* Embree's scene, in the processor's memory: where that is what OpenGL has, too, it counts. */
struct host_scene {
    struct scene_attachment attachment;
    struct pen_trace_scene *trace;
    uint32_t moved, remade; /* the scene's, when it was made */
};

static void destroy(struct scene_attachment *attachment)
{
    struct host_scene *s = container_of(attachment, struct host_scene, attachment);
    pen_trace_scene_destroy(s->trace);
    free(s);
}

static struct pen_trace_scene *trace_scene(const struct technique_run *run, struct pen_error *error)
{
    struct scene *scene = run->scene;
    struct pen_trace_scene_options options = {
        .max_bytes = run->ctx->software ? run->ctx->gpu_memory : 0};
    struct scene_attachment *known = scene_attachment(scene, destroy);
    if (known) {
        struct host_scene *s = container_of(known, struct host_scene, attachment);
        if (s->moved == scene->moved && s->remade == scene->remade)
            return s->trace;
        scene_detach(scene, known);
    }
    struct pen_trace_scene *trace = pen_trace_scene_create(&scene->blob, &options, error);
    if (!trace)
        return NULL;
    struct host_scene *s = pen_alloc_zero(1, sizeof *s);
    s->attachment.destroy = destroy;
    s->trace = trace;
    s->moved = scene->moved;
    s->remade = scene->remade;
    scene_attach(scene, &s->attachment);
    return trace;
}

static void count_memory(const struct technique_run *run, const struct pen_trace_scene *trace)
{
    if (run->ctx->software)
        scene_attachment_resize(
            run->scene, scene_attachment(run->scene, destroy), pen_trace_scene_info(trace).bytes);
}

/* The emission texture as floats; freed by the caller. */
static float *read_emission(const struct technique_run *run, struct pen_trace_light *light)
{
    if (!run->face->textured)
        return NULL;
    size_t bytes = (size_t)run->emission->width * run->emission->height * 16;
    float *texels = pen_alloc(bytes, 1);
    gl.GetTextureImage(run->emission->name, 0, GL_RGBA, GL_FLOAT, (GLsizei)bytes, texels);
    light->emission = texels;
    light->columns = run->emission->width, light->rows = run->emission->height;
    light->bilinear = true;
    return texels;
}

struct waiting {
    struct technique_run *run;
    const struct ray_job *job;
    struct ray_targets *targets;
    const struct pen_trace_result *result;
    const struct host_picture *picture;
    struct pen_error *error;
    float *seen; /* the visibility that is shown, which ends up in vis at once */
};

static bool turn(void *context)
{
    struct waiting *w = context;
    return pass_turn(w->run->ctx, w->error);
}

static enum pen_trace_step step(void *context, uint32_t done, uint32_t total)
{
    static const enum pen_trace_step steps[] = {
        [STEP_GO_ON] = PEN_TRACE_GO_ON, [STEP_SHOW] = PEN_TRACE_SHOW, [STEP_STOP] = PEN_TRACE_STOP};
    struct waiting *w = context;
    return steps[pass_step(w->run, done, total)];
}

bool ray_host_settles(const struct technique_run *run, const struct ray_job *job)
{
    return job->denoising || run->light->face_count == 1;
}

static void write_target(const struct technique_run *run, struct gl_target *target, GLenum format,
    GLenum layout, const float *from)
{
    gl_target_fit(target, format, run->width, run->height, 0, 1);
    gl.TextureSubImage2D(target->texture.name, 0, 0, 0, (GLsizei)run->width, (GLsizei)run->height,
        layout, GL_FLOAT, from);
}

static void settle_on_host(const struct waiting *w, const float *visibility)
{
    host_picture_settle(w->run, w->picture, w->job->weighting == PEN_TRACE_AREA, visibility);
}

static void write_result(const struct waiting *w)
{
    struct technique_run *run = w->run;
    const struct pen_trace_result *result = w->result;
    if (ray_host_settles(run, w->job))
        settle_on_host(w, result->visibility);
    else
        write_target(run, &w->targets->visibility, GL_RGBA32F, GL_RGBA, result->visibility);
    if (result->standard_error)
        write_target(run, &w->targets->standard_error, GL_R32F, GL_RED, result->standard_error);
}

static bool show(void *context)
{
    struct waiting *w = context;
    size_t bytes = (size_t)w->run->width * w->run->height * 16;
    if (ray_host_settles(w->run, w->job))
        w->seen = memcpy(pen_alloc(bytes, 1), w->result->visibility, bytes);
    else
        write_result(w);
    return true;
}

static void hold(void *crew, bool away)
{
    struct pen_trace_crew *c = crew;
    c->hold(c, away);
}

/* Rays are traced on meanwhile, but not while others have the turn. */
static bool shown(void *context, struct pen_trace_crew *crew)
{
    struct waiting *w = context;
    struct technique_ctx *ctx = w->run->ctx;
    ctx->turns.away = hold;
    ctx->turns.away_context = crew;
    gl_timer_end(&ctx->timer);
    if (w->seen)
        settle_on_host(w, w->seen);
    bool ok = (w->seen || w->job->settle(w->run, w->error)) && pass_show(w->run, w->error);
    free(w->seen);
    w->seen = NULL;
    gl_timer_begin(&ctx->timer, PEN_STAGE_TECHNIQUE, "trace");
    ctx->turns.away = NULL;
    return ok;
}

static void destroy_kept(void *kept)
{
    pen_trace_kept_destroy(kept);
}

/* One light's, for all of its faces. */
static struct kept_sum *open_kept(struct technique_run *run, const struct ray_job *job)
{
    bool plain = job->weighting == PEN_TRACE_AREA && !run->face->textured;
    uint64_t bytes = pen_trace_kept_bytes((size_t)run->width * run->height, plain);
    struct kept_sum *kept =
        kept_sum_open(run, trace_points_round(job->samples), run->light->face_count, bytes);
    if (kept) {
        kept->bytes = bytes;
        kept->destroy = destroy_kept;
    }
    return kept;
}

/* What all jobs have of a frame. */
static struct pen_trace_job make_job(
    const struct technique_run *run, const struct host_picture *picture, struct waiting *waiting)
{
    struct pen_trace_job job = {.view = &picture->view,
        .width = run->width,
        .height = run->height,
        .front_only = run->request->casters == PEN_CASTERS_FRONT,
        .depth_error = RAY_DEPTH_ERROR,
        .aim_error = ray_aim_error(run)};
    memcpy(job.eye, run->view->eye, sizeof job.eye);
    if (run->ctx->turns.fiber) {
        job.turn = turn;
        job.turn_context = waiting;
        job.turn_ms = run->ctx->turns.most_ms;
    }
    return job;
}

/* A light's rays under way. */
struct work {
    struct waiting waiting;
    struct pen_trace_scene *scene;
    struct pen_trace_light light;
    struct pen_trace_job job;
    struct pen_trace_stats stats;
    struct host_picture picture;
    float *emission;
};

static bool begin(struct work *w, struct technique_run *run, const struct ray_job *job,
    struct ray_targets *targets, struct pen_error *error)
{
    *w = (struct work){.scene = trace_scene(run, error)};
    if (!w->scene)
        return false;
    w->waiting = (struct waiting){run, job, targets, NULL, &w->picture, error};
    w->light = ray_light(run);
    w->emission = read_emission(run, &w->light);
    w->job = make_job(run, &w->picture, &w->waiting);
    w->job.seed = job->seed;
    gl_timer_begin(&run->ctx->timer, PEN_STAGE_TECHNIQUE, "read back");
    host_picture_read(run, &w->picture);
    gl_timer_end(&run->ctx->timer);
    gl_timer_begin(&run->ctx->timer, PEN_STAGE_TECHNIQUE, "trace");
    return true;
}

static void end_rays(struct work *w, bool ok)
{
    struct technique_run *run = w->waiting.run;
    gl_timer_end(&run->ctx->timer);
    count_memory(run, w->scene);
    run->result->rays += ok ? w->stats.rays : 0;
    run->result->full_work_pixels += ok ? (uint32_t)w->stats.full_receivers : 0;
}

/* Rays alone: many of them, shown on the way. */
static bool gather(struct work *w)
{
    struct technique_run *run = w->waiting.run;
    const struct ray_job *job = w->waiting.job;
    size_t count = (size_t)run->width * run->height;
    float *visibility = pen_alloc(count, 16), *standard_error = pen_alloc(count, 4);
    struct pen_trace_result result = {.visibility = visibility,
        .standard_error = run->variance_framebuffer ? standard_error : NULL};
    struct kept_sum *kept = open_kept(run, job);
    struct pen_trace_kept *gathered = kept ? kept->own : NULL;
    w->waiting.result = &result;
    w->job.samples = job->samples;
    w->job.target_error = job->target_error;
    w->job.weighting = job->weighting;
    w->job.adaptive = job->adaptive;
    if (w->job.turn) {
        w->job.step = step;
        w->job.show = show;
        w->job.shown = shown;
    }
    if (kept) { /* it is the job's now */
        kept->own = NULL;
        kept->samples = 0;
        w->job.kept = &gathered;
    }
    bool ok =
        pen_trace_visibility(w->scene, &w->light, &w->job, &result, &w->stats, w->waiting.error);
    end_rays(w, ok);
    if (kept) {
        kept->own = gathered;
        kept->samples = pen_trace_kept_samples(gathered);
    }
    if (ok)
        write_result(&w->waiting);
    free(w->waiting.seen);
    free(visibility);
    free(standard_error);
    return ok;
}

static bool denoise(struct work *w)
{
    struct technique_run *run = w->waiting.run;
    const struct ray_denoising *how = w->waiting.job->denoising;
    uint16_t *halves = pen_alloc((size_t)run->width * run->height, 4 * sizeof *halves);
    w->job.samples = how->samples;
    bool ok = pen_trace_denoised(w->scene, &w->light, &w->job,
        &(struct pen_trace_denoising){how->refine, how->budget}, halves, &w->stats,
        w->waiting.error);
    end_rays(w, ok);
    if (ok)
        host_picture_write(run, halves);
    free(halves);
    return ok;
}

bool pass_rays_host(struct technique_run *run, const struct ray_job *job, struct ray_targets *t,
    struct pen_error *error)
{
    struct work w;
    if (!begin(&w, run, job, t, error))
        return false;
    bool ok = job->denoising ? denoise(&w) : gather(&w);
    host_picture_finish(&w.picture);
    free(w.emission);
    return ok && pass_turn(run->ctx, error);
}
