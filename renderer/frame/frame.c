#include "renderer/frame/frame.h"
#include "protocol/container.h"
#include "renderer/frame/blended.h"
#include "renderer/frame/edges.h"
#include "renderer/frame/layers.h"
#include "renderer/frame/needs.h"
#include "renderer/frame/output.h"
#include "renderer/frame/progress.h"
#include "renderer/frame/resolution.h"
#include "renderer/frame/shade.h"
#include "renderer/light/meter.h"
#include "renderer/passes/draw/gbuffer.h"
#include "renderer/passes/draw/screen.h"
#include "renderer/passes/draw/turn.h"
#include "renderer/passes/filter/changed.h"
#include "renderer/passes/filter/history.h"
#include "renderer/passes/map/bound.h"
#include "renderer/passes/map/shadow_cache.h"
#include <cglm/cglm.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#define SKETCH_SAMPLES 16

struct frame {
    const struct frame_job *job;
    struct view view;
    struct light lights[PEN_MAX_LIGHTS];
    const struct emission *emissions[PEN_MAX_LIGHTS]; /* NULL: no texture */
    uint32_t light_count;
    struct pen_result *result;
    uint64_t triangles;
    bool classified;               /* at least one light of one frame */
    bool coarse;                   /* said of one light */
    uint32_t number;               /* of the jittered frame */
    const struct gbuffer *gbuffer; /* what is lit */
    bool layer;                    /* it is a blended one */
    bool data;                     /* data layers are about it */
    bool sky_known;                /* of it */
    bool shaded;                   /* the picture is, with what was visible when it was shown */
    bool sketching; /* few samples of each light are taken, so that there is something of all */
    bool sketched;  /* that is done */
    struct frame_work work;
    struct frame_progress progress;
    struct technique_watch watch;
};

static bool fit_targets(struct frame *f, struct pen_error *error)
{
    struct frame_targets *t = f->job->targets;
    const struct pen_request *r = f->job->request;
    if (!frame_output_room(f->job, f->light_count, error))
        return false;
    frame_output_fit(t, r);
    gl_target_fit(&t->vis, GL_RGBA16F, r->width, r->height, f->light_count ? f->light_count : 1, 1);
    if (frame_is_layered(f->job))
        frame_blended_fit(f->job);
    if (frame_output_is_direct(f->job) && frame_edges_are_drawn(f->job))
        gl_target_fit(&t->stairs, GL_RGBA8, r->width, r->height, 0, 1);
    if (!frame_output_is_direct(f->job) && frame_needs(r, PEN_SOURCE_BEAUTY))
        frame_fit_sum(&t->beauty, GL_RGBA32F, r);
    if (frame_needs(r, PEN_SOURCE_VISIBILITY))
        frame_fit_sum(&t->visibility, GL_RGBA32F, r);
    return pass_turn(f->job->ctx, error);
}

static bool resolve_emissions(struct frame *f, struct pen_error *error)
{
    const struct frame_job *job = f->job;
    const struct pen_technique_info *info = &job->technique->info;
    bool averaged = false;
    for (uint32_t i = 0; i < f->light_count; i++) {
        const struct pen_light *source = f->lights[i].source;
        if (source->texture == PEN_TEXTURE_NONE)
            continue;
        const struct scene *image =
            source->texture == PEN_TEXTURE_IMAGE ? job->find_image(job->owner, source) : NULL;
        f->emissions[i] =
            emission_cache_get(job->emissions, source, image, job->request->time_s, error);
        if (!f->emissions[i])
            return false;
        for (uint32_t k = 0; k < f->lights[i].face_count; k++) {
            f->lights[i].faces[k].textured = 1;
            memcpy(f->lights[i].faces[k].emission_mean, f->emissions[i]->mean, 12);
        }
        averaged |= !info->textured;
    }
    if (averaged)
        pen_result_warn(f->result,
            "%s knows one visibility per light: textured lights shine in their mean colour.",
            info->title);
    return true;
}

static void aim_face(struct frame *f, struct light_face *face)
{
    struct technique_ctx *ctx = f->job->ctx;
    glm_mat4_mul((vec4 *)face->world_to_light, f->view.clip_to_world, (vec4 *)face->clip_to_light);
    gl.NamedBufferData(ctx->light_block, sizeof *face, face, GL_STREAM_DRAW);
    gl.BindBufferBase(GL_UNIFORM_BUFFER, UBO_LIGHT, ctx->light_block);
    gl.BindBufferBase(GL_UNIFORM_BUFFER, UBO_PARAMS, ctx->param_block);
}

/* Of a method that writes vis with its last face, all faces are bounded then. */
static bool bound_faces(struct frame *f, struct technique_run *run, struct pen_error *error)
{
    struct light *light = &f->lights[run->light_index];
    if (!run->bound.late || light->face_count == 1)
        return pass_bound(run, error);
    run->tiles = NULL; /* of one face */
    for (uint32_t k = 0; k < light->face_count && pass_is_last_face(run); k++) {
        struct technique_run each = *run;
        each.face = &light->faces[k];
        aim_face(f, &light->faces[k]);
        if (!pass_bound(&each, error))
            return false;
    }
    return true;
}

/* What is lit is the picture's, and last of it. */
static bool is_picture(const struct frame *f)
{
    return !f->layer && f->data != frame_is_layered(f->job);
}

/* Of the first jittered frame, when there is something of all lights. The next ones are mixed in
 * whole. */
static bool is_watchable(const struct frame *f, uint32_t light, uint32_t face)
{
    bool last = light + 1 == f->light_count && face + 1 == f->lights[light].face_count;
    return is_picture(f) && f->number == 0 && (last || f->sketched) && !f->sketching;
}

static bool record_face(
    struct frame *f, uint32_t light, uint32_t number, bool *counted, struct pen_error *error)
{
    const struct frame_job *job = f->job;
    struct light_face *face = &f->lights[light].faces[number];
    struct technique_ctx *ctx = job->ctx;
    shadow_cache_release(ctx); /* of many lights, not all fit at once */
    aim_face(f, face);
    const struct emission *emission = f->emissions[light];
    struct technique_run run = {.ctx = ctx,
        .scene = job->scene,
        .view = &f->view,
        .gbuffer = f->gbuffer,
        .light = &f->lights[light],
        .face = face,
        .request = job->request,
        .technique = job->technique,
        .params = job->request->technique_params,
        .state = job->technique_state,
        .vis_framebuffer = job->targets->vis.framebuffer,
        .vis = &job->targets->vis.texture,
        .emission = emission ? &emission->texture : &ctx->white,
        .result = f->result,
        .width = job->request->width,
        .height = job->request->height,
        .frame = f->number,
        .light_index = light,
        .watch = is_watchable(f, light, number) ? &f->watch : NULL,
        .history = f->sketching || !is_picture(f) ? NULL : job->history,
        .sums = f->sketching || !is_picture(f) ? NULL : job->sums,
        .variance_framebuffer =
            f->data && !f->sketching && frame_layers_want_error(job->request, job->technique)
                ? job->targets->variance.framebuffer
                : 0};
    if (!job->technique->record(&run, error))
        return false;
    if (f->sketching)
        return bound_faces(f, &run, error);
    if (f->number == 0)
        f->coarse = f->coarse || frame_warn_of_resolution(&run);
    *counted |= run.work_counted;
    f->classified |= run.tiles != NULL;
    const struct gl_texture *tiles = run.tiles;
    return bound_faces(f, &run, error) &&
           (!f->data || !frame_layers_want_classes(job->request) ||
               frame_layers_add_classes(job, tiles, number == 0, error));
}

/* uncounted: lights of which the method has not counted its full work. */
static bool record_light(
    struct frame *f, uint32_t light, uint32_t *uncounted, struct pen_error *error)
{
    bool counted = false;
    for (uint32_t k = 0; k < f->lights[light].face_count; k++)
        if (!f->progress.stopped && !record_face(f, light, k, &counted, error))
            return false;
    *uncounted += !counted;
    return true;
}

static void upload_params(const struct frame *f)
{
    const struct pen_request *r = f->job->request;
    gl.NamedBufferData(
        f->job->ctx->param_block, sizeof r->technique_params, r->technique_params, GL_STREAM_DRAW);
}

static void aim_light(const struct frame *f, uint32_t light)
{
    const struct gl_target *vis = &f->job->targets->vis;
    f->job->ctx->turns.light = light;
    gl_target_aim(vis, 0, light);
    /* What an unshadowed receiver sees. */
    if (!f->sketched)
        gl_target_clear(vis, f->lights[light].faces[0].emission_mean);
}

static bool shows_sketch(const struct frame *f)
{
    return is_picture(f) && frame_progress_wants_sketch(&f->progress);
}

/* Somebody looks, and there are several lights, or faces of one: SKETCH_SAMPLES of each come first,
 * or there would be nothing to see before the last is at work. A method without steps that has to be
 * shown in time, or soon, begins with cheaper settings. False: neither. */
static bool lower(const struct frame *f, uint32_t *params)
{
    const struct technique *technique = f->job->technique;
    const struct pen_param *row = pen_param_find(technique->info.params, "samples");
    const double few = SKETCH_SAMPLES;
    if (technique->sketch)
        return (frame_progress_is_limited(&f->progress) || shows_sketch(f)) &&
               frame_progress_lower(technique, params);
    return f->progress.faces > 1 && f->progress.tracked && row &&
           pen_param_load(row, params, 0) >= 4 * few &&
           pen_param_store(row, params, &few, "", NULL);
}

/* Lights from `first` on. *is: there is something of them. */
static bool sketch(struct frame *f, uint32_t first, uint32_t end, bool *is, struct pen_error *error)
{
    uint32_t params[PEN_TECHNIQUE_PARAM_BYTES / 4];
    struct pen_result before = *f->result;
    bool counted, ok = true;
    memcpy(params, f->job->request->technique_params, sizeof params);
    *is = lower(f, params);
    if (!*is)
        return true;
    memcpy(f->job->request->technique_params, params, sizeof params);
    upload_params(f);
    f->sketching = true;
    for (uint32_t i = first; i < end && ok; i++) {
        aim_light(f, i);
        for (uint32_t k = 0; k < f->lights[i].face_count && ok; k++)
            ok = record_face(f, i, k, &counted, error);
    }
    f->sketching = false;
    *f->result = before; /* it counts nothing */
    return ok;
}

static bool show_estimate(struct frame *f, struct pen_error *error);

/* In the first jittered frame. */
static bool begin(struct frame *f, struct pen_error *error)
{
    struct frame_progress *p = &f->progress;
    double start = p->ahead_ms = p->step_ms = frame_progress_ms(p);
    bool is, steps = !f->job->technique->sketch;
    if (!sketch(f, 0, f->light_count, &is, error))
        return false;
    f->sketched = is && steps;
    if (f->sketched)
        frame_progress_sketch(p, p->faces, SKETCH_SAMPLES);
    if (!is || steps)
        return true;
    if (frame_progress_is_limited(p)) {
        f->result->progress.done = 1; /* something is there */
        frame_progress_sketched(p, frame_progress_ms(p) - start, true);
    }
    bool ok = !shows_sketch(f) || show_estimate(f, error);
    frame_progress_spent(p);
    return ok;
}

/* The time was up in the midst of a light that there is a sketch of; those after it have theirs. */
static bool fall_back(struct frame *f, uint32_t light, struct pen_error *error)
{
    struct technique_turns *turns = &f->job->ctx->turns;
    bool is;
    if (!turns->stopped)
        return false;
    turns->stopped = false;
    f->progress.stopped = true;
    frame_progress_sketched(&f->progress, 0, false);
    *error = (struct pen_error){0};
    return sketch(f, light, light + 1, &is, error);
}

/* The sky's shadow of this jittered frame. */
static bool know_sky(struct frame *f, struct pen_error *error)
{
    const struct pen_request *r = f->job->request;
    if (f->sky_known || !r->sky.on || !frame_needs(r, PEN_SOURCE_BEAUTY))
        return true;
    f->sky_known = true;
    const struct gl_texture *around = f->layer ? &f->job->targets->gbuffer.depth.texture : NULL;
    return sky_occlusion(f->job, f->gbuffer, around, error);
}

static bool record_visibility(struct frame *f, struct pen_error *error)
{
    const struct frame_job *job = f->job;
    uint32_t uncounted = 0, receivers = 0;
    /* What is left to do after the samples is to be small. */
    if (frame_progress_is_limited(&f->progress) && !know_sky(f, error))
        return false;
    if (f->number == 0 && !begin(f, error))
        return false;
    upload_params(f);
    for (uint32_t i = 0; i < f->light_count && !f->progress.stopped; i++) {
        aim_light(f, i);
        if (!record_light(f, i, &uncounted, error) && !fall_back(f, i, error))
            return false;
    }
    frame_progress_sketched(&f->progress, 0, false);
    f->sketched = false;
    if (frame_is_layered(job)) {
        bool ok = !uncounted || frame_layers_count_now(job, f->gbuffer, &receivers, error);
        f->result->full_work_pixels += uncounted * receivers;
        return ok;
    }
    f->work.lights[f->number] = uncounted;
    return !uncounted || frame_layers_count_receivers(job, f->number, &f->work, error);
}

static bool shade(struct frame *f, bool shown, struct pen_error *error)
{
    const struct frame_job *job = f->job;
    struct shading shading = {.view = &f->view,
        .gbuffer = f->gbuffer,
        .lights = f->lights,
        .light_count = f->light_count,
        .layer = f->layer};
    if (!frame_output_is_direct(job))
        return frame_shade(job, &shading, error);
    /* What has not changed since the last picture is as it was. */
    if ((shown || f->shaded) &&
        !pass_changed(job->ctx, &job->targets->vis.texture, f->shaded, &shading.tiles, error))
        return false;
    f->shaded = shown;
    return frame_shade(job, &shading, error);
}

/* Light and shadow of what is in a G-buffer. */
static bool light_up(struct frame *f, bool beauty, struct pen_error *error)
{
    return (!frame_needs_shadows(f->job->request) || record_visibility(f, error)) &&
           (!beauty || (know_sky(f, error) && shade(f, false, error)));
}

static bool draw(
    struct frame *f, struct gbuffer_pass pass, struct gbuffer *g, struct pen_error *error)
{
    const struct frame_job *job = f->job;
    f->gbuffer = g;
    f->sky_known = false;
    f->layer = pass.kind == GBUFFER_LAYER;
    pass.ground = !f->layer && job->request->ground.on;
    pass.ground_albedo = job->request->ground_albedo;
    return pass_gbuffer(job->ctx, job->scene, &f->view, &pass, g, &f->triangles, error);
}

static bool render_layers(struct frame *f, struct pen_error *error)
{
    const struct frame_job *job = f->job;
    struct gbuffer *solid = &job->targets->gbuffer, *layer = &job->targets->layer;
    uint32_t pixels = 1;
    f->data = false;
    frame_blended_begin(job);
    if (!draw(f, (struct gbuffer_pass){.kind = GBUFFER_SOLID}, solid, error))
        return false;
    for (uint32_t i = 0; i < BLENDED_LAYERS && pixels; i++) {
        if (!draw(f, frame_blended_pass(job, i), layer, error) ||
            !frame_layers_count_now(job, layer, &pixels, error) ||
            (pixels && !light_up(f, true, error)))
            return false;
        frame_blended_next(job, i);
    }
    f->gbuffer = solid;
    f->sky_known = false;
    f->layer = false;
    return light_up(f, true, error) && frame_blended_end(job, error);
}

/* The pass list. */
static bool render_jittered(struct frame *f, uint32_t number, struct pen_error *error)
{
    const struct frame_job *job = f->job;
    const struct pen_request *r = job->request;
    bool layered = frame_is_layered(job), beauty = frame_needs(r, PEN_SOURCE_BEAUTY);
    struct gbuffer *g = layered ? &job->targets->layer : &job->targets->gbuffer;
    f->number = job->ctx->turns.frame = number;
    frame_output_aim(job, &f->view, number);
    if (layered && !render_layers(f, error))
        return false;
    if (layered && r->output.layer != PEN_LAYER_ALL)
        return true;
    f->data = true;
    return draw(f, (struct gbuffer_pass){.kind = GBUFFER_HASHED}, g, error) &&
           light_up(f, beauty && !layered, error) &&
           (!frame_needs(r, PEN_SOURCE_VISIBILITY) ||
               frame_layers_add_visibility(f->job, f->light_count, error));
}

static bool show_frame(struct frame *f, uint32_t frames, struct pen_error *error)
{
    const struct frame_job *job = f->job;
    struct pen_frame picture;
    struct pen_result result = *f->result;
    frame_edges_keep(job);
    if (!frame_output_read(job, &f->view, frames, &picture, error))
        return false;
    gl_timer_collect(&job->ctx->timer, &result);
    frame_progress_tell(&f->progress, &result);
    result.turns_ms = frame_progress_ms(&f->progress);
    job->viewer.show(job->viewer.context, &picture, &result);
    return true;
}

/* What of the picture there is to see while its first frame is not complete; the sums start afresh
 * then. */
static bool show_estimate(struct frame *f, struct pen_error *error)
{
    struct frame_targets *t = f->job->targets;
    static const float zero[4] = {0};
    bool beauty = frame_needs(f->job->request, PEN_SOURCE_BEAUTY),
         visibility = frame_needs(f->job->request, PEN_SOURCE_VISIBILITY);
    bool layered = frame_is_layered(f->job);
    if (layered)
        frame_blended_keep(f->job);
    bool ok = (!beauty || (know_sky(f, error) && shade(f, true, error))) &&
              (!layered || frame_blended_end(f->job, error)) &&
              (!visibility || frame_layers_add_visibility(f->job, f->light_count, error)) &&
              show_frame(f, 1, error);
    if (layered)
        frame_blended_restore(f->job);
    if (beauty && !frame_output_is_direct(f->job))
        gl_target_clear(&t->beauty, zero);
    if (visibility)
        gl_target_clear(&t->visibility, zero);
    return ok;
}

static enum technique_step on_step(struct technique_run *run, uint32_t done, uint32_t total)
{
    struct frame *f = container_of(run->watch, struct frame, watch);
    f->result->progress.done = done; /* something is there */
    uint32_t unit = (uint32_t)(run->face - run->light->faces);
    for (uint32_t i = 0; i < run->light_index; i++)
        unit += f->lights[i].face_count;
    return frame_progress_step(&f->progress, unit, done, total);
}

static bool on_show(struct technique_run *run, struct pen_error *error)
{
    struct frame *f = container_of(run->watch, struct frame, watch);
    struct frame_progress *p = &f->progress;
    struct technique_run bounded = *run;
    bool ok = bound_faces(f, &bounded, error) && frame_progress_compare(p, error) &&
              (!p->show_wanted || !frame_can_show(f->job->request) || show_estimate(f, error));
    aim_face(f, (struct light_face *)run->face);
    frame_progress_spent(p);
    return ok;
}

/* After a jittered frame that is not the last. */
static bool look_up(struct frame *f, bool *enough, struct pen_error *error)
{
    struct frame_progress *p = &f->progress;
    enum technique_step step = frame_progress_next(p);
    f->result->progress.done = 1; /* something is there */
    *enough = step == STEP_STOP;
    if (step != STEP_SHOW)
        return true;
    bool ok =
        frame_progress_compare(p, error) && (!p->show_wanted || show_frame(f, p->frames, error));
    frame_progress_spent(p);
    return ok;
}

bool frame_render(const struct frame_job *job, struct pen_frame *frame, struct pen_result *result,
    struct pen_error *error)
{
    struct frame f = {.job = job, .result = result};
    struct pen_request *r = job->request;
    bool ok = false;
    memset(frame, 0, sizeof *frame);
    gl_timer_reset(&job->ctx->timer);
    shadow_cache_begin_frame(job->ctx);
    bool chosen = r->camera.mode == PEN_CAMERA_AUTO;
    if (!view_resolve(&f.view, &r->camera, job->scene, r->width, r->height, error))
        return false;
    if (chosen && r->ground.on && f.view.eye[1] < scene_ground_top(job->scene)) {
        r->ground.on = false;
        pen_result_warn(result,
            "The scene shows its surfaces to the underside alone, from where the "
            "picture is; there is no ground in it.");
    }
    bool scenes_own = !r->lights_given;
    f.light_count =
        lights_resolve(f.lights, r, job->scene, history_key_view(job->history, r, &f.view), result);
    light_choose_exposure(r, f.lights, f.light_count, scenes_own, job->scene);
    uint32_t faces = 1;
    for (uint32_t i = 0; i < f.light_count; i++)
        faces += f.lights[i].face_count;
    job->ctx->shadow_budget = job->ctx->shadow_memory / (faces > 1 ? faces - 1 : 1);
    if (!resolve_emissions(&f, error))
        return false;
    if (!fit_targets(&f, error))
        return false;
    frame_layers_begin(job, result);
    f.watch = (struct technique_watch){on_step, on_show};
    frame_progress_begin(&f.progress, job, f.light_count, faces - 1);
    bool enough = false;
    for (uint32_t i = 0; i < r->antialias && !enough; i++) {
        if (r->antialias > 1)
            view_jitter(&f.view, i);
        if (!render_jittered(&f, i, error) || !look_up(&f, &enough, error))
            goto done;
        if (f.progress.late) {
            pen_fail(
                error, PEN_DEADLINE, "/deadline_ms", "Nothing of the image was ready in time.");
            goto done;
        }
    }
    if (f.progress.tracked && !frame_progress_compare(&f.progress, error))
        goto done;
    if (!frame_output_read(job, &f.view, f.progress.frames + !f.progress.frames, frame, error))
        goto done;
    frame_progress_end(&f.progress, result);
    frame_layers_end(job, &f.work, f.classified, result);
    gl_timer_collect(&job->ctx->timer, result);
    result->shadow_inputs_reused = shadow_cache_all_reused(job->ctx);
    result->triangles_drawn = (uint32_t)f.triangles;
    ok = true;
done:
    frame_edges_drop(job->targets);
    if (job->technique->finish)
        job->technique->finish(job->ctx, job->technique_state, result);
    gl.DeleteQueries(PEN_MAX_ANTIALIAS, f.work.queries);
    return ok;
}
