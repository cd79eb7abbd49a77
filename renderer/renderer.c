#include "renderer/renderer.h"
#include "protocol/memory.h"
#include "renderer/frame/output.h"
#include "renderer/generate/generate.h"
#include "renderer/gl/context.h"
#include "renderer/passes/draw/kept_sums.h"
#include "renderer/passes/filter/history.h"
#include "renderer/residency.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#define DEFAULT_BUDGET (2ull << 30)
#define EMISSION_BYTES (64u << 20) /* kept emission textures; they are cheap to make again */

struct pen_render {
    struct pen_renderer *renderer;
    struct lane lane;
    struct residency_share share;
    GLenum gl_error; /* the first one in its turns */
};

struct pen_renderer {
    struct gl_context *context;
    struct pen_device_info device;
    struct technique_ctx ctx; /* what lanes share */
    struct residency residency;
    struct pen_render renders[PEN_MAX_RENDERS];
    const struct pen_render *advanced; /* the last one */
    enum pen_loss loss;
    struct technique_speed speeds[TECHNIQUE_SPEEDS];
};

struct pen_renderer *pen_renderer_create(
    const struct pen_renderer_config *config, struct pen_error *error)
{
    struct pen_renderer *r = pen_alloc_zero(1, sizeof *r);
    r->context = gl_context_create(&config->device, &r->device, error);
    if (!r->context) {
        free(r);
        return NULL;
    }
    r->ctx.software = r->device.software && !config->as_gpu;
    r->ctx.is_called = config->is_called;
    r->ctx.call_context = config->call_context;
    r->ctx.speeds = r->speeds;
    residency_start(&r->residency, &r->ctx,
        config->gpu_memory_bytes ? config->gpu_memory_bytes : DEFAULT_BUDGET, config->programs,
        config->session_idle_ms);
    gl_samplers_init(&r->ctx.samplers);
    gl.CreateVertexArrays(1, &r->ctx.empty_array);
    r->ctx.white = gl_texture_create(GL_RGBA8, 1, 1, 0, 1);
    static const uint8_t white[4] = {255, 255, 255, 255};
    gl.TextureSubImage2D(r->ctx.white.name, 0, 0, 0, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, white);
    for (uint32_t i = 0; i < PEN_MAX_RENDERS; i++) {
        r->renders[i].renderer = r;
        residency_share_start(&r->residency, &r->renders[i].share, &r->renders[i].lane);
    }
    if (!lane_make(&r->renders[0].lane, &r->ctx, 0, error)) {
        pen_renderer_destroy(r);
        return NULL;
    }
    return r;
}

void pen_renderer_destroy(struct pen_renderer *r)
{
    if (!r)
        return;
    for (uint32_t i = 0; i < PEN_MAX_RENDERS; i++)
        lane_finish(&r->renders[i].lane);
    residency_stop(&r->residency);
    gl_samplers_finish(&r->ctx.samplers);
    gl_texture_destroy(&r->ctx.white);
    gl.DeleteVertexArrays(1, &r->ctx.empty_array);
    gl_context_destroy(r->context);
    free(r);
}

const struct pen_device_info *pen_renderer_device(const struct pen_renderer *r)
{
    return &r->device;
}

struct pen_program_counts pen_renderer_programs(const struct pen_renderer *r)
{
    return gl_programs_counts(r->ctx.programs);
}

uint64_t pen_renderer_gpu_bytes(const struct pen_renderer *r)
{
    return residency_bytes(&r->residency);
}

enum pen_loss pen_renderer_loss(struct pen_renderer *r)
{
    if (r->loss == PEN_LOSS_NONE) {
        GLenum reset = gl.GetGraphicsResetStatus();
        r->loss = reset == GL_NO_ERROR                 ? PEN_LOSS_NONE
                  : reset == GL_INNOCENT_CONTEXT_RESET ? PEN_LOSS_OTHERS
                                                       : PEN_LOSS_OWN;
    }
    return r->loss;
}

/* What OpenGL says now is about what was just done, for `render` (NULL: none). Returns the error. */
static GLenum take_error(struct pen_renderer *r, struct pen_render *render)
{
    GLenum error = gl_take_error();
    if (error == GL_OUT_OF_MEMORY && r->loss == PEN_LOSS_NONE)
        r->loss = PEN_LOSS_MEMORY;
    else if (error == GL_CONTEXT_LOST && pen_renderer_loss(r) == PEN_LOSS_NONE)
        r->loss = PEN_LOSS_OWN;
    if (render && error != GL_NO_ERROR && render->gl_error == GL_NO_ERROR)
        render->gl_error = error;
    return error;
}

bool pen_renderer_load_scene(
    struct pen_renderer *r, const uint8_t id[PEN_ID_BYTES], int fd, struct pen_error *error)
{
    pen_renderer_drop_views(r); /* a scene of this id may have been another */
    if (!residency_load(&r->residency, id, fd, error))
        return false;
    GLenum gl_error = take_error(r, NULL);
    if (gl_error == GL_NO_ERROR)
        return true;
    residency_drop(&r->residency, id);
    return pen_fail(
        error, PEN_INTERNAL, "", "Loading the scene, OpenGL reported error 0x%04x.", gl_error);
}

bool pen_renderer_has_scene(const struct pen_renderer *r, const uint8_t id[PEN_ID_BYTES])
{
    return residency_find(&r->residency, id) != NULL;
}

void pen_renderer_drop_scene(struct pen_renderer *r, const uint8_t id[PEN_ID_BYTES])
{
    residency_drop(&r->residency, id);
}

bool pen_renderer_load_image(
    struct pen_renderer *r, const uint8_t id[PEN_ID_BYTES], int fd, struct pen_error *error)
{
    return pen_renderer_load_scene(r, id, fd, error);
}

bool pen_renderer_has_image(const struct pen_renderer *r, const uint8_t id[PEN_ID_BYTES])
{
    return pen_renderer_has_scene(r, id);
}

static const struct scene *find_image(void *owner, const struct pen_light *light)
{
    struct pen_renderer *r = owner;
    struct scene *scene = residency_find(&r->residency, light->image);
    if (scene)
        scene->last_use = ++r->residency.clock;
    return scene;
}

static bool is_posed_alike(const struct pen_request *a, const struct pen_request *b)
{
    return a->time_s == b->time_s && !strcmp(a->animation, b->animation) &&
           !strcmp(a->variant, b->variant);
}

/* The scene cannot be in two poses at a time. */
static bool can_pose(struct pen_renderer *r, struct scene *scene, const struct pen_request *request)
{
    for (uint32_t i = 0; i < PEN_MAX_RENDERS; i++) {
        const struct lane *lane = &r->renders[i].lane;
        const struct pen_request *other = lane->busy ? &lane->result->completed : NULL;
        if (other && lane->job.scene == scene && !is_posed_alike(other, request))
            return false;
    }
    return true;
}

/* Frames of one session come one after the other. */
static bool is_session_busy(const struct pen_renderer *r, const struct pen_request *request)
{
    return pen_request_is_stateful(request, pen_renderer_catalogue()) &&
           history_is_busy(r->ctx.histories, request);
}

static struct pen_render *free_render(struct pen_renderer *r)
{
    for (uint32_t i = 0; i < PEN_MAX_RENDERS; i++)
        if (!r->renders[i].lane.busy)
            return &r->renders[i];
    return NULL;
}

/* Of what a request needs, the bytes that are resident; of the others about what their files say. */
static uint64_t blob_bytes(
    const struct pen_renderer *r, const struct pen_blobs *blobs, bool resident)
{
    uint64_t bytes = 0;
    for (uint32_t i = 0; i < blobs->count; i++) {
        const struct scene *scene = residency_find(&r->residency, blobs->ids[i]);
        struct stat status;
        if ((scene != NULL) != resident)
            continue;
        if (scene)
            bytes += scene->bytes;
        else if (!fstat(blobs->fds[i], &status))
            bytes += (uint64_t)status.st_size;
    }
    return bytes;
}

static uint64_t picture_bytes(const struct pen_renderer *r, const struct pen_request *request)
{
    uint32_t lights = request->light_count;
    const struct scene *scene = residency_find(&r->residency, request->scene);
    if (!request->lights_given && scene)
        lights =
            scene->blob.light_count < PEN_MAX_LIGHTS ? scene->blob.light_count : PEN_MAX_LIGHTS;
    return frame_output_estimate(request, lights, scene && scene->may_blend);
}

static bool load_blobs(
    struct pen_renderer *r, const struct pen_blobs *blobs, struct pen_error *error)
{
    for (uint32_t i = 0; i < blobs->count; i++) {
        struct scene *scene = residency_find(&r->residency, blobs->ids[i]);
        if (scene)
            scene->last_use = ++r->residency.clock;
        else if (!pen_renderer_load_scene(r, blobs->ids[i], blobs->fds[i], error))
            return false;
    }
    return true;
}

enum pen_admission pen_renderer_admit(struct pen_renderer *r, const struct pen_request *request,
    const struct pen_blobs *blobs, struct pen_error *error)
{
    struct scene *scene = residency_find(&r->residency, request->scene);
    bool alone = !residency_is_any_busy(&r->residency);
    enum pen_admission admission = PEN_LATER;
    if (!free_render(r) || (scene && !can_pose(r, scene, request)) || is_session_busy(r, request))
        return PEN_LATER;
    r->residency.wanted = blobs->ids;
    r->residency.wanted_count = blobs->count;
    /* Room first, so that old and new are never there together; and nothing is loaded in vain while
     * others are there. */
    uint64_t more = blob_bytes(r, blobs, false) + picture_bytes(r, request);
    if (!residency_make_room(&r->residency, more, NULL) && !alone)
        goto done;
    if (!load_blobs(r, blobs, error)) {
        admission = PEN_REFUSED;
        goto done;
    }
    uint64_t picture = picture_bytes(r, request);
    if (residency_make_room(&r->residency, picture, NULL)) {
        admission = PEN_ADMITTED;
    } else if (alone) {
        pen_fail(error, PEN_TOO_BIG, "",
            "The scene needs %.0f MiB of GPU memory with its images, a picture of this size, with "
            "these lights and layers about %.0f MiB; %.0f MiB are allowed. Ask for fewer pixels, "
            "or "
            "have --gpu-memory raised.",
            (double)blob_bytes(r, blobs, true) / (1 << 20), (double)picture / (1 << 20),
            (double)r->residency.budget / (1 << 20));
        admission = PEN_REFUSED;
    }
done:
    r->residency.wanted_count = 0;
    if (admission != PEN_ADMITTED)
        residency_make_room(&r->residency, 0, NULL);
    return admission;
}

struct pen_render *pen_render_begin(struct pen_renderer *r, const struct pen_request *request,
    struct pen_frame *frame, struct pen_result *result, struct pen_error *error)
{
    memset(result, 0, sizeof *result);
    memset(frame, 0, sizeof *frame);
    result->completed = *request;
    result->device = r->device;
    struct scene *scene = residency_find(&r->residency, request->scene);
    struct pen_render *render = free_render(r);
    if (!pen_request_check(request, pen_renderer_catalogue(), error))
        goto fail;
    if (!scene || !render || !can_pose(r, scene, request) || is_session_busy(r, request)) {
        pen_fail(error, PEN_INTERNAL, "",
            scene ? "Too much is in progress." : "The scene is not resident.");
        goto fail;
    }
    uint32_t t = 0;
    while (strcmp(technique_registry[t]->info.name, request->technique))
        t++;
    scene->last_use = ++r->residency.clock;
    residency_rest_others(&r->residency, scene);
    scene->rests = false;
    if (!scene_set_pose(scene, request, error))
        goto fail;
    struct lane *lane = &render->lane;
    if (!lane_make(lane, &r->ctx, (uint32_t)(render - r->renders), error))
        goto fail;
    lane->job = (struct frame_job){.ctx = &lane->ctx,
        .targets = &lane->targets,
        .scene = scene,
        .request = &result->completed,
        .technique = technique_registry[t],
        .technique_state = lane->states[t],
        .emissions = r->residency.emissions,
        .find_image = find_image,
        .owner = r};
    render->gl_error = GL_NO_ERROR;
    render->share.need = picture_bytes(r, request);
    if (technique_registry[t]->info.keeps_history)
        lane->job.history = history_open(r->ctx.histories, lane->ctx.lane, request);
    lane_begin(lane, &render->share.targets, frame, result);
    return render;
fail:
    if (error)
        result->error = *error;
    return NULL;
}

void pen_render_watch(struct pen_render *render, const struct pen_viewer *viewer)
{
    render->lane.job.viewer = *viewer;
}

void pen_render_limit(struct pen_render *render, double budget_ms, double until_ms)
{
    render->lane.job.budget_ms = budget_ms;
    render->lane.job.until_ms = until_ms;
}

void pen_render_continue(struct pen_render *render)
{
    struct pen_renderer *r = render->renderer;
    struct frame_job *job = &render->lane.job;
    uint64_t claimed = residency_claimed(&r->residency);
    if (job->technique->keeps_sums)
        job->sums = kept_sums_open(r->ctx.kept_sums, job->request, &job->technique->info,
            claimed < r->residency.budget ? r->residency.budget - claimed : 0);
}

bool pen_render_advance(struct pen_render *render, double ms)
{
    struct pen_renderer *r = render->renderer;
    if (r->ctx.software && r->advanced != render)
        gl_wait(); /* what another has under way would be taken for this one's */
    r->advanced = render;
    r->residency.drawing = &render->share;
    bool ended = lane_advance(&render->lane, ms);
    take_error(r, render);
    r->residency.drawing = NULL;
    return ended;
}

struct pen_place pen_render_place(const struct pen_render *render)
{
    const struct technique_ctx *ctx = &render->lane.ctx;
    const struct technique_turns *turns = &ctx->turns;
    struct pen_place place = {turns->number, turns->frame, turns->light, ""};
    if (ctx->timer.count)
        memcpy(place.pass, ctx->timer.passes[ctx->timer.count - 1].name, sizeof place.pass);
    return place;
}

bool pen_render_end(struct pen_render *render, struct pen_error *error)
{
    struct pen_renderer *r = render->renderer;
    struct lane *lane = &render->lane;
    struct pen_result *result = lane->result;
    struct pen_frame *frame = lane->frame;
    bool cancelled = !lane->ended;
    if (cancelled)
        lane_cancel(lane);
    struct pen_error failure = lane->error;
    bool ok = lane->ok && !cancelled && failure.code != PEN_LOST;
    lane->busy = false;
    history_close(r->ctx.histories, lane->job.history, ok);
    history_store_trim(r->ctx.histories, UINT64_MAX);
    lane->job.history = NULL;
    kept_sums_close(r->ctx.kept_sums, lane->job.sums);
    lane->job.sums = NULL;
    shadow_cache_release(&lane->ctx);
    uint64_t since = lane->programs_since;
    for (uint32_t i = 0; i < PEN_MAX_RENDERS; i++) {
        const struct lane *other = &r->renders[i].lane;
        if (other->busy && other->programs_since < since)
            since = other->programs_since;
    }
    gl_programs_end_frame(r->ctx.programs, since);
    if (!residency_is_any_busy(&r->residency))
        emission_cache_trim(r->residency.emissions, EMISSION_BYTES);
    residency_make_room(&r->residency, 0, lane->job.scene); /* what the lane keeps may go, too */
    result->gpu_bytes = pen_renderer_gpu_bytes(r);
    result->programs = gl_programs_counts(r->ctx.programs);
    take_error(r, render);
    if (ok && render->gl_error == GL_NO_ERROR)
        return true;
    if (ok)
        pen_fail(&failure, PEN_INTERNAL, "", "OpenGL reported error 0x%04x.", render->gl_error);
    pen_frame_finish(frame);
    result->error = failure;
    if (error)
        *error = failure;
    return false;
}

bool pen_renderer_render(struct pen_renderer *r, const struct pen_request *request,
    struct pen_frame *frame, struct pen_result *result, struct pen_error *error)
{
    struct pen_render *render = pen_render_begin(r, request, frame, result, error);
    if (!render)
        return false;
    while (!pen_render_advance(render, INFINITY))
        ;
    return pen_render_end(render, error);
}

void pen_renderer_drop_shadows(struct pen_renderer *r)
{
    shadow_cache_trim(r->ctx.shadows, 0);
    pen_renderer_drop_views(r);
}

void pen_renderer_drop_views(struct pen_renderer *r)
{
    for (uint32_t i = 0; i < PEN_MAX_RENDERS; i++)
        frame_targets_forget(&r->renders[i].lane.targets);
}

bool pen_renderer_is_called(const struct pen_renderer *r)
{
    return r->ctx.is_called && r->ctx.is_called(r->ctx.call_context);
}
