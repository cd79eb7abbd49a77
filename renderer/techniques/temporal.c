#include "renderer/passes/draw/passes.h"
#include "renderer/passes/draw/turn.h"
#include "renderer/passes/filter/history.h"
#include "renderer/techniques/sample_params.h"
#include <math.h>
#include <string.h>

#define MOST_WHEN_STILL (1u << 20) /* samples: beyond, a float's mean does not change any more */

struct temporal {
    uint32_t samples;
    uint32_t map_size;
    uint32_t weighting;
    float bias;
    uint32_t most, most_moving;
    float plane_px, normal_deg, clip;
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
    PARAM(struct temporal, most_moving, .def = 12, .min = 1, .max = 65536, .unit = "samples",
        .help = "The same while an animation moves the scene."),
    PARAM(struct temporal, plane_px, .def = 1, .min = 0.01, .max = 100, .unit = "px",
        .help = "The past of a pixel is that of another surface when it lies farther beside the "
                "pixel's plane than so many pixels are wide."),
    PARAM(struct temporal, normal_deg, .def = 25, .min = 0.1, .max = 180, .unit = "deg",
        .help = "Or when it faces another way by more than this."),
    PARAM(struct temporal, clip, .def = 1.5, .min = 0, .max = 100, .unit = "standard errors",
        .help = "While an animation moves the scene, how far the past may be from the new samples; "
                "0: any."),
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

static bool add_samples(struct technique_run *run, uint32_t first, bool keep,
    const struct gl_target *sum, struct pen_error *error)
{
    const struct temporal *params = run->params;
    struct sample_point points[SAMPLE_MAP_BATCH];
    struct sample_batch batch = {
        "temporal lookup", points, params->samples, params->map_size, keep, params->samples};
    sample_sequence(run->face, first, params->samples, points);
    return sample_batch_add(run, &batch, sum, error);
}

static bool join(struct technique_run *run, const struct gl_target *sum, struct pen_error *error)
{
    const struct temporal *params = run->params;
    const struct history_set *last = history_last(run);
    struct state *s = run->state;
    struct temporal_block block = {.fresh = {(float)params->samples, (float)params->most},
        .limits = {params->plane_px, cosf(params->normal_deg * (float)M_PI / 180)}};
    const struct history_layer *before = last ? &last->layers[run->light_index] : NULL;
    const float *open = run->face->emission_mean;
    if (before) {
        bool moved = history_has_moved(run);
        bool still = !memcmp(
            last->view.world_to_clip, run->view->world_to_clip, sizeof last->view.world_to_clip);
        memcpy(block.world_to_clip, last->view.world_to_clip, sizeof block.world_to_clip);
        memcpy(block.clip_to_world, last->view.clip_to_world, sizeof block.clip_to_world);
        block.last[0] = last->view.near_z;
        block.last[1] = still;
        block.last[2] = 1;
        block.last[3] = run->face->textured ? fmaxf(open[0] + open[1] + open[2], 1e-6f) : 1;
        if (moved)
            block.fresh[1] = (float)params->most_moving;
        else if (still)
            block.fresh[1] = MOST_WHEN_STILL;
        block.limits[2] = moved ? params->clip : 0;
    }
    struct pass_texture textures[] = {
        {UNIT_DEPTH, run->gbuffer->depth.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_NORMAL, run->gbuffer->normal.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_FRESH, sum->texture.name, GL_SAMPLE_NEAREST},
        {UNIT_LAST_MEAN, before ? before->mean.name : sum->texture.name, GL_SAMPLE_NEAREST},
        {UNIT_LAST_STATE, before ? before->state.name : sum->texture.name, GL_SAMPLE_NEAREST}};
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

/* All faces of the light, whose receivers are all there now. */
static bool resolve(struct technique_run *run, GLuint mean, struct pen_error *error)
{
    struct pass_texture texture = {UNIT_SOURCE, mean, GL_SAMPLE_NEAREST};
    struct pass_screen pass = {.name = "temporal resolve",
        .body = "multisample_resolve.glsl",
        .textures = &texture,
        .texture_count = 1};
    bool ok = true;
    for (uint32_t k = 0; k < run->light->face_count && ok; k++) {
        struct technique_run each = *run;
        each.face = &run->light->faces[k];
        gl.NamedBufferData(run->ctx->light_block, sizeof *each.face, each.face, GL_STREAM_DRAW);
        ok = pass_screen(&each, &pass, error);
    }
    return ok;
}

static bool record(struct technique_run *run, struct pen_error *error)
{
    const struct temporal *params = run->params;
    static const struct pass_targets key = {1};
    static const float zero[4] = {0};
    struct gl_target *sum = pass_targets(run->ctx, &key);
    if (pass_is_first_face(run)) {
        history_begin(run);
        gl_target_fit(sum, GL_RGBA32F, run->width, run->height, 0, 1);
        gl_target_clear(sum, zero);
    }
    bool goes_on = history_goes_on(run);
    uint32_t first = goes_on ? history_samples(run, params->samples) : run->frame * params->samples;
    uint64_t bytes = (uint64_t)params->samples * params->map_size * params->map_size * 4;
    bool keep = !goes_on && bytes * run->request->antialias <= run->ctx->shadow_budget;
    run->map_size = run->bound.map_size = params->map_size;
    run->bound.texels = 2;
    run->bound.late = true;
    if (!add_samples(run, first, keep, sum, error))
        return false;
    if (!pass_is_last_face(run))
        return true;
    if (!goes_on)
        return resolve(run, sum->texture.name, error);
    return join(run, sum, error) && resolve(run, history_next(run)->mean.name, error);
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
                     "without a session; shadows of animated casters follow a few frames late; "
                     "narrow shadows blur by a pixel or two while the camera moves.",
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
