#include "renderer/renderer.h"
#include "protocol/memory.h"
#include "renderer/lane.h"
#include "renderer/frame/output.h"
#include "renderer/generate/generate.h"
#include "renderer/gl/context.h"
#include "renderer/passes/draw/kept_sums.h"
#include "renderer/passes/filter/history.h"
#include "renderer/passes/map/shadow_cache.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#define MAX_RESIDENT 256
#define DEFAULT_BUDGET (2ull << 30)
#define SESSION_IDLE_MS 60e3
#define EMISSION_BYTES (64u << 20) /* kept emission textures; they are cheap to make again */

struct pen_render {
    struct pen_renderer *renderer;
    struct lane lane;
    uint64_t target_bytes; /* of its lane */
    uint64_t need;         /* what these are expected to come to */
};

struct pen_renderer {
    struct gl_context *context;
    struct pen_device_info device;
    struct technique_ctx ctx; /* what lanes share */
    struct pen_render renders[PEN_MAX_RENDERS];
    const struct pen_render *advanced; /* the last one */
    uint64_t budget, clock;
    bool lost;
    struct scene *scenes[MAX_RESIDENT]; /* emission images too: scenes without geometry */
    uint32_t scene_count;
    struct emission_cache *emissions;
    struct technique_speed speeds[TECHNIQUE_SPEEDS];
    const struct pen_blobs *admitting; /* not evicted now */
};

static bool make_room(struct pen_renderer *r, uint64_t more, const struct scene *keep);

static void make_room_in_frame(void *owner, uint64_t bytes)
{
    make_room(owner, bytes, NULL);
}

struct pen_renderer *pen_renderer_create(
    const struct pen_renderer_config *config, struct pen_error *error)
{
    struct pen_renderer *r = pen_alloc_zero(1, sizeof *r);
    r->context = gl_context_create(&config->device, &r->device, error);
    if (!r->context) {
        free(r);
        return NULL;
    }
    r->budget = config->gpu_memory_bytes ? config->gpu_memory_bytes : DEFAULT_BUDGET;
    r->ctx.gpu_memory = r->budget;
    r->ctx.shadow_memory = r->budget / 4;
    r->ctx.software = r->device.software;
    r->ctx.is_called = config->is_called;
    r->ctx.call_context = config->call_context;
    r->ctx.make_room = make_room_in_frame;
    r->ctx.room_owner = r;
    r->ctx.programs = gl_programs_create(config->programs);
    r->ctx.speeds = r->speeds;
    r->ctx.shadows = shadow_cache_create();
    r->ctx.histories = history_store_create(
        r->budget / 4, config->session_idle_ms > 0 ? config->session_idle_ms : SESSION_IDLE_MS);
    r->ctx.kept_sums = kept_sums_store_create(r->budget / 8);
    r->emissions = emission_cache_create();
    gl_samplers_init(&r->ctx.samplers);
    gl.CreateVertexArrays(1, &r->ctx.empty_array);
    r->ctx.white = gl_texture_create(GL_RGBA8, 1, 1, 0, 1);
    static const uint8_t white[4] = {255, 255, 255, 255};
    gl.TextureSubImage2D(r->ctx.white.name, 0, 0, 0, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, white);
    for (uint32_t i = 0; i < PEN_MAX_RENDERS; i++)
        r->renders[i].renderer = r;
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
    for (uint32_t i = 0; i < r->scene_count; i++)
        scene_destroy(r->scenes[i]);
    shadow_cache_destroy(r->ctx.shadows);
    history_store_destroy(r->ctx.histories);
    kept_sums_store_destroy(r->ctx.kept_sums);
    emission_cache_destroy(r->emissions);
    gl_samplers_finish(&r->ctx.samplers);
    gl_programs_destroy(r->ctx.programs);
    gl_texture_destroy(&r->ctx.white);
    gl.DeleteVertexArrays(1, &r->ctx.empty_array);
    gl_context_destroy(r->context);
    free(r);
}

const struct pen_device_info *pen_renderer_device(const struct pen_renderer *r)
{
    return &r->device;
}

static struct scene *find_scene(const struct pen_renderer *r, const uint8_t id[PEN_ID_BYTES])
{
    for (uint32_t i = 0; i < r->scene_count; i++)
        if (!memcmp(r->scenes[i]->id, id, PEN_ID_BYTES))
            return r->scenes[i];
    return NULL;
}

static uint64_t scene_bytes(const struct pen_renderer *r)
{
    uint64_t bytes = 0;
    for (uint32_t i = 0; i < r->scene_count; i++)
        bytes += r->scenes[i]->bytes;
    return bytes;
}

static uint64_t cached_bytes(const struct pen_renderer *r)
{
    return scene_bytes(r) + shadow_cache_bytes(r->ctx.shadows) +
           emission_cache_bytes(r->emissions) + history_store_bytes(r->ctx.histories) +
           kept_sums_store_bytes(r->ctx.kept_sums);
}

uint64_t pen_renderer_gpu_bytes(const struct pen_renderer *r)
{
    uint64_t bytes = cached_bytes(r);
    for (uint32_t i = 0; i < PEN_MAX_RENDERS; i++)
        bytes += r->renders[i].target_bytes;
    return bytes;
}

/* What is held, and what renders in progress will still take. */
static uint64_t claimed_bytes(const struct pen_renderer *r)
{
    uint64_t bytes = cached_bytes(r);
    for (uint32_t i = 0; i < PEN_MAX_RENDERS; i++) {
        const struct pen_render *render = &r->renders[i];
        bool more = render->lane.busy && render->need > render->target_bytes;
        bytes += more ? render->need : render->target_bytes;
    }
    return bytes;
}

struct pen_program_counts pen_renderer_programs(const struct pen_renderer *r)
{
    return gl_programs_counts(r->ctx.programs);
}

/* A frame in progress reads it. */
static bool is_read(const struct pen_renderer *r, const struct scene *scene)
{
    for (uint32_t i = 0; i < PEN_MAX_RENDERS; i++) {
        const struct lane *lane = &r->renders[i].lane;
        if (!lane->busy)
            continue;
        const struct pen_request *request = &lane->result->completed;
        if (lane->job.scene == scene)
            return true;
        for (uint32_t k = 0; k < request->light_count; k++)
            if (request->lights[k].texture == PEN_TEXTURE_IMAGE &&
                !memcmp(request->lights[k].image, scene->id, PEN_ID_BYTES))
                return true;
    }
    return false;
}

/* The same, or one that is about to begin will. */
static bool is_used(const struct pen_renderer *r, const struct scene *scene)
{
    for (uint32_t i = 0; r->admitting && i < r->admitting->count; i++)
        if (!memcmp(r->admitting->ids[i], scene->id, PEN_ID_BYTES))
            return true;
    return is_read(r, scene);
}

static void remove_scene(struct pen_renderer *r, uint32_t i)
{
    shadow_cache_drop_scene(r->ctx.shadows, r->scenes[i]);
    emission_cache_drop(r->emissions, r->scenes[i]->id);
    kept_sums_store_drop(r->ctx.kept_sums, r->scenes[i]->id);
    scene_destroy(r->scenes[i]);
    r->scenes[i] = r->scenes[--r->scene_count];
}

static bool is_any_busy(const struct pen_renderer *r)
{
    for (uint32_t i = 0; i < PEN_MAX_RENDERS; i++)
        if (r->renders[i].lane.busy)
            return true;
    return false;
}

/* Frees something that can be made again, the cheapest first: sums that somebody may ask more of,
 * targets that nobody draws into, shadow inputs, sessions, emission textures, scenes, hierarchies for rays. False: all that is left is in use. */
static bool evict(struct pen_renderer *r, uint64_t bytes, const struct scene *keep)
{
    uint64_t least = UINT64_MAX, before = kept_sums_store_bytes(r->ctx.kept_sums);
    kept_sums_store_trim(r->ctx.kept_sums, before > bytes ? before - bytes : 0);
    if (kept_sums_store_bytes(r->ctx.kept_sums) < before)
        return true;
    for (uint32_t i = 0; i < PEN_MAX_RENDERS; i++)
        if (!r->renders[i].lane.busy && r->renders[i].target_bytes) {
            lane_finish(&r->renders[i].lane);
            return true;
        }
    before = shadow_cache_bytes(r->ctx.shadows);
    shadow_cache_trim(r->ctx.shadows, before > bytes ? before - bytes : 0);
    if (shadow_cache_bytes(r->ctx.shadows) < before)
        return true;
    before = history_store_bytes(r->ctx.histories);
    history_store_trim(r->ctx.histories, before > bytes ? before - bytes : 0);
    if (history_store_bytes(r->ctx.histories) < before)
        return true;
    before = emission_cache_bytes(r->emissions);
    if (before && !is_any_busy(r)) {
        emission_cache_trim(r->emissions, 0);
        return true;
    }
    uint32_t oldest = UINT32_MAX;
    for (uint32_t i = 0; i < r->scene_count; i++)
        if (r->scenes[i] != keep && r->scenes[i]->last_use < least && !is_used(r, r->scenes[i]))
            least = r->scenes[i]->last_use, oldest = i;
    if (oldest != UINT32_MAX) {
        remove_scene(r, oldest);
        return true;
    }
    for (uint32_t i = 0; i < r->scene_count; i++)
        if (!is_read(r, r->scenes[i]) && scene_shed(r->scenes[i]))
            return true;
    return false;
}

/* Evicts until the budget holds with so many bytes more. `keep` stays whatever happens. */
static bool make_room(struct pen_renderer *r, uint64_t more, const struct scene *keep)
{
    for (;;) {
        uint64_t bytes = claimed_bytes(r) + more;
        if (bytes <= r->budget && r->scene_count < MAX_RESIDENT)
            return true;
        if (!evict(r, bytes > r->budget ? bytes - r->budget : 0, keep))
            return false;
    }
}

static bool load(struct pen_renderer *r, struct scene *scene, struct pen_error *error)
{
    if (!scene)
        return false;
    if (scene->bytes > r->budget) {
        pen_fail(error, PEN_TOO_BIG, "",
            "The scene needs %.0f MiB of GPU memory; %.0f MiB are allowed.",
            (double)scene->bytes / (1 << 20), (double)r->budget / (1 << 20));
        scene_destroy(scene);
        return false;
    }
    scene->last_use = ++r->clock;
    r->scenes[r->scene_count++] = scene;
    make_room(r, 0, scene);
    return true;
}

bool pen_renderer_load_scene(
    struct pen_renderer *r, const uint8_t id[PEN_ID_BYTES], int fd, struct pen_error *error)
{
    return find_scene(r, id) || load(r, scene_create(id, fd, error), error);
}

bool pen_renderer_has_scene(const struct pen_renderer *r, const uint8_t id[PEN_ID_BYTES])
{
    return find_scene(r, id) != NULL;
}

void pen_renderer_drop_scene(struct pen_renderer *r, const uint8_t id[PEN_ID_BYTES])
{
    for (uint32_t i = 0; i < r->scene_count; i++)
        if (!memcmp(r->scenes[i]->id, id, PEN_ID_BYTES)) {
            if (is_used(r, r->scenes[i]))
                r->scenes[i]->last_use = 0; /* the first to be evicted */
            else
                remove_scene(r, i);
            return;
        }
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
    struct scene *scene = find_scene(r, light->image);
    if (scene)
        scene->last_use = ++r->clock;
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
        const struct scene *scene = find_scene(r, blobs->ids[i]);
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
    const struct scene *scene = find_scene(r, request->scene);
    if (!request->lights_given && scene)
        lights =
            scene->blob.light_count < PEN_MAX_LIGHTS ? scene->blob.light_count : PEN_MAX_LIGHTS;
    return frame_output_estimate(request, lights, scene && scene->may_blend);
}

static bool load_blobs(
    struct pen_renderer *r, const struct pen_blobs *blobs, struct pen_error *error)
{
    for (uint32_t i = 0; i < blobs->count; i++) {
        struct scene *scene = find_scene(r, blobs->ids[i]);
        if (scene)
            scene->last_use = ++r->clock;
        else if (!pen_renderer_load_scene(r, blobs->ids[i], blobs->fds[i], error))
            return false;
    }
    return true;
}

enum pen_admission pen_renderer_admit(struct pen_renderer *r, const struct pen_request *request,
    const struct pen_blobs *blobs, struct pen_error *error)
{
    struct scene *scene = find_scene(r, request->scene);
    bool alone = !is_any_busy(r);
    enum pen_admission admission = PEN_LATER;
    if (!free_render(r) || (scene && !can_pose(r, scene, request)) || is_session_busy(r, request))
        return PEN_LATER;
    r->admitting = blobs;
    /* Room first, so that old and new are never there together; and nothing is loaded in vain while
     * others are there. */
    uint64_t more = blob_bytes(r, blobs, false) + picture_bytes(r, request);
    if (!make_room(r, more, NULL) && !alone)
        goto done;
    if (!load_blobs(r, blobs, error)) {
        admission = PEN_REFUSED;
        goto done;
    }
    uint64_t picture = picture_bytes(r, request);
    if (make_room(r, picture, NULL)) {
        admission = PEN_ADMITTED;
    } else if (alone) {
        pen_fail(error, PEN_TOO_BIG, "",
            "The scene needs %.0f MiB of GPU memory with its images, a picture of this size, with "
            "these lights and layers about %.0f MiB; %.0f MiB are allowed. Ask for fewer pixels, "
            "or "
            "have --gpu-memory raised.",
            (double)blob_bytes(r, blobs, true) / (1 << 20), (double)picture / (1 << 20),
            (double)r->budget / (1 << 20));
        admission = PEN_REFUSED;
    }
done:
    r->admitting = NULL;
    if (admission != PEN_ADMITTED)
        make_room(r, 0, NULL);
    return admission;
}

struct pen_render *pen_render_begin(struct pen_renderer *r, const struct pen_request *request,
    struct pen_frame *frame, struct pen_result *result, struct pen_error *error)
{
    memset(result, 0, sizeof *result);
    memset(frame, 0, sizeof *frame);
    result->completed = *request;
    result->device = r->device;
    struct scene *scene = find_scene(r, request->scene);
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
    scene->last_use = ++r->clock;
    for (uint32_t i = 0; i < r->scene_count; i++)
        if (r->scenes[i] != scene && !is_used(r, r->scenes[i]))
            scene_rest(r->scenes[i]);
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
        .emissions = r->emissions,
        .find_image = find_image,
        .owner = r};
    render->need = picture_bytes(r, request);
    if (technique_registry[t]->info.keeps_history)
        lane->job.history = history_open(r->ctx.histories, lane->ctx.lane, request);
    lane_begin(lane, frame, result);
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
    uint64_t claimed = claimed_bytes(r);
    if (job->technique->keeps_sums)
        job->sums = kept_sums_open(r->ctx.kept_sums, job->request, &job->technique->info,
            claimed < r->budget ? r->budget - claimed : 0);
}

bool pen_render_advance(struct pen_render *render, double ms)
{
    struct pen_renderer *r = render->renderer;
    if (r->ctx.software && r->advanced != render)
        gl_wait(); /* what another has under way would be taken for this one's */
    r->advanced = render;
    gl_targets_charge(&render->target_bytes);
    bool ended = lane_advance(&render->lane, ms);
    gl_targets_charge(NULL);
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
    shadow_cache_end_frame(&lane->ctx);
    uint64_t since = lane->programs_since;
    for (uint32_t i = 0; i < PEN_MAX_RENDERS; i++) {
        const struct lane *other = &r->renders[i].lane;
        if (other->busy && other->programs_since < since)
            since = other->programs_since;
    }
    gl_programs_end_frame(r->ctx.programs, since);
    if (!is_any_busy(r))
        emission_cache_trim(r->emissions, EMISSION_BYTES);
    make_room(r, 0, lane->job.scene); /* what the lane keeps may go, too */
    result->gpu_bytes = pen_renderer_gpu_bytes(r);
    result->programs = gl_programs_counts(r->ctx.programs);
    GLenum gl_error = gl.GetError();
    if (ok && gl_error == GL_NO_ERROR)
        return true;
    if (gl_error == GL_CONTEXT_LOST || gl_error == GL_OUT_OF_MEMORY)
        r->lost = true;
    if (ok)
        pen_fail(&failure, PEN_INTERNAL, "", "OpenGL reported error 0x%04x.", gl_error);
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
}

bool pen_renderer_is_lost(struct pen_renderer *r)
{
    return r->lost || gl.GetGraphicsResetStatus() != GL_NO_ERROR;
}
