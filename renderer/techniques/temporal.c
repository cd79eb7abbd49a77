#include "renderer/passes/draw/passes.h"
#include "renderer/passes/draw/turn.h"
#include "renderer/passes/filter/history.h"
#include "renderer/passes/filter/penumbra.h"
#include "renderer/techniques/penumbra_params.h"
#include "renderer/techniques/sample_params.h"
#include <math.h>
#include <string.h>

#define MOST_WHEN_STILL (1u << 20) /* samples: beyond, a float's mean does not change any more */

#define SAMPLES_KEPT 24 /* whose maps serve the next frames while the camera moves */

struct temporal {
    uint32_t samples;
    uint32_t map_size;
    uint32_t weighting;
    float bias;
    uint32_t most, most_moving;
    float plane_px, normal_deg, clip;
    float smooth;
    uint32_t search_taps;
    float min_filter;
    uint32_t max_radius;
};

static const struct pen_param rows[] = {
    PARAM(struct temporal, samples, .def = 4, .min = 1, .max = SAMPLE_MAP_BATCH,
        .help = "Points on the light that each frame adds, each with a shadow map of its own."),
    MAP_SIZE_ROW(struct temporal, 1024),
    WEIGHTING_ROW(struct temporal),
    BIAS_ROW(struct temporal),
    PARAM(struct temporal, most, .def = 20, .min = 1, .max = 65536, .unit = "samples",
        .help = "How much the past counts at most while the camera moves; older frames fade. With "
                "a camera and a scene that stand still, everything counts."),
    PARAM(struct temporal, most_moving, .def = 8, .min = 1, .max = 65536, .unit = "samples",
        .help = "The same while an animation moves the scene."),
    PARAM(struct temporal, plane_px, .def = 1, .min = 0.01, .max = 100, .unit = "px",
        .help = "The past of a pixel is that of another surface when it lies farther beside the "
                "pixel's plane than so many pixels are wide."),
    PARAM(struct temporal, normal_deg, .def = 25, .min = 0.1, .max = 180, .unit = "deg",
        .help = "Or when it faces another way by more than this."),
    PARAM(struct temporal, clip, .def = 1.5, .min = 0, .max = 100, .unit = "standard errors",
        .help = "While an animation moves the scene, how far the past may be from the new samples; "
                "0: any."),
    PARAM(struct temporal, smooth, .def = 1.5, .min = 0, .max = 4,
        .help = "While an animation moves the scene: over how much of the part of a penumbra that "
                "one of a pixel's samples stands for its steps are smoothed; 0: not at all."),
    PENUMBRA_ROWS(struct temporal, 12),
    PARAM(struct temporal, max_radius, .def = 128, .min = 1, .max = 1024, .unit = "px",
        .help = "Largest reach of that on the screen."),
};

#define SHARED_ROWS "renderer/techniques/temporal.def"
#include "renderer/shared/rows_c.h"

struct state {
    GLuint counts; /* COUNT_RECEIVERS, COUNT_CARRIED */
    bool counted;
    uint32_t frames; /* before this one; that it has a history of */
};

static bool create(struct technique_ctx *ctx, void *state, struct pen_error *error)
{
    (void)ctx, (void)error;
    struct state *s = state;
    static const uint32_t zero[2];
    gl.CreateBuffers(1, &s->counts);
    gl.NamedBufferData(s->counts, sizeof zero, zero, GL_DYNAMIC_READ);
    return true;
}

static void destroy(struct technique_ctx *ctx, void *state)
{
    (void)ctx;
    gl.DeleteBuffers(1, &((struct state *)state)->counts);
}

/* What the last frame tells this one. */
struct past {
    const struct history_set *last;
    const struct history_layer *layer; /* of this light; NULL: nothing */
    bool moved, still;                 /* the scene has; neither it nor the camera has */
    /* Maps of so many samples before are kept, in batches as frames take them; 0: those are not. */
    uint32_t batches;
};

static void look_back(const struct technique_run *run, struct past *past)
{
    const struct temporal *params = run->params;
    uint64_t bytes = (uint64_t)SAMPLES_KEPT * params->map_size * params->map_size * 4;
    memset(past, 0, sizeof *past);
    if (!history_goes_on(run))
        return;
    past->last = history_last(run);
    past->batches = bytes <= run->ctx->shadow_budget ? SAMPLES_KEPT / params->samples : 0;
    past->batches = past->batches > 1 ? past->batches : 0;
    if (!past->last)
        return;
    past->layer = &past->last->layers[run->light_index];
    past->moved = history_has_moved(run);
    past->still = !past->moved && !memcmp(past->last->view.world_to_clip, run->view->world_to_clip,
                                      sizeof run->view->world_to_clip);
    if (past->moved)
        past->batches = 0;
}

/* Pixels have few samples while the scene moves. */
static bool is_smoothed(const struct technique_run *run, const struct past *past)
{
    const struct temporal *params = run->params;
    return past->layer && past->moved && params->smooth > 0 && run->face->extent[0] > 0;
}

/* Of the frame's first sample. While the camera moves a few batches come round again, which pixels
 * that the past tells nothing of can then have all of. */
static uint32_t first_sample(const struct technique_run *run, const struct past *past)
{
    const struct temporal *params = run->params;
    if (!history_goes_on(run))
        return run->frame * params->samples;
    uint32_t first = history_samples(run, params->samples);
    bool round = past->layer && !past->still && past->batches;
    return round ? first % (past->batches * params->samples) : first;
}

static bool add_samples(struct technique_run *run, const struct past *past,
    const struct gl_target *sum, struct pen_error *error)
{
    const struct temporal *params = run->params;
    struct sample_point points[SAMPLE_MAP_BATCH];
    uint32_t first = first_sample(run, past);
    uint64_t bytes = (uint64_t)params->samples * params->map_size * params->map_size * 4;
    bool keep = history_goes_on(run) ? first < past->batches * params->samples
                                     : bytes * run->request->antialias <= run->ctx->shadow_budget;
    struct sample_batch batch = {.name = "temporal lookup",
        .points = points,
        .count = params->samples,
        .map_size = params->map_size,
        .keep = keep,
        .total = params->samples};
    sample_sequence(run->face, first, params->samples, points);
    return sample_batch_add(run, &batch, sum, error);
}

static void fill_block(
    const struct technique_run *run, const struct past *past, struct temporal_block *block)
{
    const struct temporal *params = run->params;
    const float *open = run->face->emission_mean;
    *block = (struct temporal_block){.fresh = {(float)params->samples, (float)params->most},
        .limits = {params->plane_px, cosf(params->normal_deg * (float)M_PI / 180)}};
    if (!past->layer)
        return;
    const struct view *view = &past->last->view;
    memcpy(block->world_to_clip, view->world_to_clip, sizeof block->world_to_clip);
    memcpy(block->clip_to_world, view->clip_to_world, sizeof block->clip_to_world);
    block->last[0] = view->near_z;
    block->last[1] = past->still || !memcmp(view->world_to_clip, run->view->world_to_clip,
                                        sizeof run->view->world_to_clip);
    block->last[2] = 1;
    block->last[3] = run->face->textured ? fmaxf(open[0] + open[1] + open[2], 1e-6f) : 1;
    if (past->moved)
        block->fresh[1] = (float)params->most_moving;
    else if (past->still)
        block->fresh[1] = MOST_WHEN_STILL;
    block->limits[2] = past->moved ? params->clip : 0;
    block->fresh[2] = params->smooth;
    block->limits[3] = !past->still && past->batches;
}

static bool join(struct technique_run *run, const struct past *past, const struct gl_target *sum,
    struct pen_error *error)
{
    struct state *s = run->state;
    struct temporal_block block;
    fill_block(run, past, &block);
    GLuint mean = past->layer ? past->layer->mean.name : sum->texture.name;
    GLuint state = past->layer ? past->layer->state.name : sum->texture.name;
    struct pass_texture textures[] = {
        {UNIT_DEPTH, run->gbuffer->depth.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_NORMAL, run->gbuffer->normal.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_FRESH, sum->texture.name, GL_SAMPLE_NEAREST},
        {UNIT_LAST_MEAN, mean, GL_SAMPLE_NEAREST}, {UNIT_LAST_STATE, state, GL_SAMPLE_NEAREST}};
    pass_bind_counts(run->ctx, s->counts);
    s->counted = true;
    s->frames = history_frames(run);
    return pass_fill(run->ctx,
        &(struct pass_fill){.name = "temporal history",
            .fragment = "temporal_history.frag",
            .stage = PEN_STAGE_TECHNIQUE,
            .textures = textures,
            .texture_count = 5,
            .framebuffer = history_next(run)->framebuffer,
            .width = run->width,
            .height = run->height,
            .extra = &block,
            .extra_bytes = sizeof block},
        error);
}

/* What follows is of all faces of the light, whose receivers are all there now. */
static struct technique_run for_face(const struct technique_run *run, uint32_t face)
{
    struct technique_run each = *run;
    each.face = &run->light->faces[face];
    gl.NamedBufferData(run->ctx->light_block, sizeof *each.face, each.face, GL_STREAM_DRAW);
    return each;
}

/* Pixels that have few samples, having come into view or where shadows are too fine to be carried
 * along, see the kept maps of the frames before, too: *more is the sum of so many batches' means. */
static bool catch_up(struct technique_run *run, const struct past *past,
    const struct gl_target *more, uint32_t *batches, struct pen_error *error)
{
    const struct temporal *params = run->params;
    struct sample_point points[SAMPLE_MAP_BATCH];
    uint32_t now = first_sample(run, past) / params->samples;
    uint32_t drawn = history_samples(run, params->samples) / params->samples;
    bool ok = true;
    *batches = 0;
    for (uint32_t i = 0; i < past->batches && i < drawn; i++) {
        if (i == now)
            continue;
        ++*batches;
        for (uint32_t k = 0; k < run->light->face_count && ok; k++) {
            struct technique_run each = for_face(run, k);
            sample_sequence(each.face, i * params->samples, params->samples, points);
            struct sample_batch batch = {.name = "temporal catching up",
                .points = points,
                .count = params->samples,
                .map_size = params->map_size,
                .keep = true,
                .total = params->samples,
                .counts = &history_next(run)->state,
                .below = 0.75f * SAMPLES_KEPT};
            ok = sample_batch_add(&each, &batch, more, error);
        }
    }
    return ok;
}

/* A pass over all of `shown`. */
static bool fill(struct technique_run *run, const char *name, const char *fragment,
    const struct pass_texture *textures, uint32_t texture_count, const struct temporal_block *block,
    const struct gl_target *shown, struct pen_error *error)
{
    return pass_fill(run->ctx,
        &(struct pass_fill){.name = name,
            .fragment = fragment,
            .stage = PEN_STAGE_TECHNIQUE,
            .textures = textures,
            .texture_count = texture_count,
            .framebuffer = shown->framebuffer,
            .width = run->width,
            .height = run->height,
            .extra = block,
            .extra_bytes = sizeof *block},
        error);
}

/* Into `shown`: what the pixels have, and what they have caught up. The next frame goes on from the
 * former. */
static bool blend(struct technique_run *run, const struct gl_target *more, uint32_t batches,
    const struct gl_target *shown, struct pen_error *error)
{
    const struct temporal *params = run->params;
    const struct history_layer *next = history_next(run);
    struct temporal_block block = {
        .fresh = {(float)(params->samples * batches), (float)params->samples}};
    struct pass_texture textures[] = {{UNIT_FRESH, more->texture.name, GL_SAMPLE_NEAREST},
        {UNIT_LAST_MEAN, next->mean.name, GL_SAMPLE_NEAREST},
        {UNIT_LAST_STATE, next->state.name, GL_SAMPLE_NEAREST}};
    return fill(run, "temporal blend", "temporal_blend.frag", textures, 3, &block, shown, error);
}

/* Of what is shown alone: nothing of it is carried on. */
static bool smooth(struct technique_run *run, const struct past *past,
    const struct gl_target *shown, struct pen_error *error)
{
    const struct history_layer *next = history_next(run);
    struct temporal_block block;
    fill_block(run, past, &block);
    struct pass_texture textures[] = {
        {UNIT_DEPTH, run->gbuffer->depth.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_NORMAL, run->gbuffer->normal.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_FRESH, next->mean.name, GL_SAMPLE_NEAREST},
        {UNIT_LAST_STATE, next->state.name, GL_SAMPLE_NEAREST},
        {UNIT_PENUMBRA, pass_penumbra_target(run, PENUMBRA_SPREAD)->texture.name,
            GL_SAMPLE_NEAREST}};
    return fill(
        run, "temporal smoothing", "temporal_smooth.frag", textures, 5, &block, shown, error);
}

static bool resolve(struct technique_run *run, GLuint mean, struct pen_error *error)
{
    struct pass_texture texture = {UNIT_SOURCE, mean, GL_SAMPLE_NEAREST};
    struct pass_screen pass = {.name = "temporal resolve",
        .body = "multisample_resolve.glsl",
        .textures = &texture,
        .texture_count = 1};
    bool ok = true;
    for (uint32_t k = 0; k < run->light->face_count && ok; k++) {
        struct technique_run each = for_face(run, k);
        ok = pass_screen(&each, &pass, error);
    }
    return ok;
}

/* All samples of the frame are there. */
static bool conclude(struct technique_run *run, const struct past *past, struct gl_target *sums,
    struct pen_error *error)
{
    static const float zero[4] = {0};
    uint32_t batches;
    if (!history_goes_on(run))
        return resolve(run, sums[0].texture.name, error);
    if (!join(run, past, &sums[0], error))
        return false;
    if (is_smoothed(run, past))
        return smooth(run, past, &sums[0], error) && resolve(run, sums[0].texture.name, error);
    if (!past->layer || past->still || !past->batches)
        return resolve(run, history_next(run)->mean.name, error);
    gl_target_fit(&sums[1], GL_RGBA32F, run->width, run->height, 0, 1);
    gl_target_clear(&sums[1], zero);
    return catch_up(run, past, &sums[1], &batches, error) &&
           blend(run, &sums[1], batches, &sums[0], error) &&
           resolve(run, sums[0].texture.name, error);
}

static bool record(struct technique_run *run, struct pen_error *error)
{
    const struct temporal *params = run->params;
    static const struct pass_targets key = {2};
    static const float zero[4] = {0};
    struct gl_target *sums = pass_targets(run->ctx, &key);
    struct past past;
    if (pass_is_first_face(run)) {
        history_begin(run);
        gl_target_fit(&sums[0], GL_RGBA32F, run->width, run->height, 0, 1);
        gl_target_clear(&sums[0], zero);
    }
    look_back(run, &past);
    run->map_size = run->bound.map_size = params->map_size;
    run->bound.texels = 2;
    run->bound.late = true;
    return (!is_smoothed(run, &past) ||
               pass_penumbra_spread(run, params->map_size, params->min_filter, error)) &&
           add_samples(run, &past, &sums[0], error) &&
           (!pass_is_last_face(run) || conclude(run, &past, sums, error));
}

static void finish(struct technique_ctx *ctx, void *state, struct pen_result *result)
{
    (void)ctx;
    struct state *s = state;
    static const uint32_t zero[2];
    uint32_t counts[2];
    if (!s->counted)
        return;
    gl.MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    gl.GetNamedBufferSubData(s->counts, 0, sizeof counts, counts);
    gl.NamedBufferSubData(s->counts, 0, sizeof zero, zero);
    result->history_frames = s->frames;
    result->history_share = counts[0] ? (float)counts[1] / (float)counts[0] : 0;
    s->counted = false;
}

const struct technique technique_temporal = {
    .info = {.name = "temporal",
        .title = "Temporal light sampling",
        .summary = "A few hard shadows from points of the light in each frame, and those of the "
                   "frames before, reprojected, where they show the same surface: frames of one "
                   "session converge to the true visibility.",
        .citation = "D. Scherzer, S. Jeschke, M. Wimmer, Pixel-correct shadow maps with temporal "
                    "reprojection and shadow test confidence, EGSR 2007; D. Scherzer, M. "
                    "Schwarzler, O. Mattausch, M. Wimmer, Real-time soft shadows using temporal "
                    "coherence, ISVC 2009",
        .artefacts = "Bands in a session's first frames, where a surface comes into view, and "
                     "without a session; shadows of animated casters follow a few frames "
                     "late." BLENDED_GRAIN,
        .cost_class = PEN_COST_MEDIUM,
        .textured = true,
        .keeps_history = true,
        .struct_size = sizeof(struct temporal),
        .params = {rows, sizeof rows / sizeof *rows}},
    .counts_horizon = true,
    .state_size = sizeof(struct state),
    .create = create,
    .record = record,
    .finish = finish,
    .destroy = destroy,
};
