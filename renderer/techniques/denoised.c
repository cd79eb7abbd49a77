#include "renderer/passes/draw/screen.h"
#include "renderer/techniques/ray_params.h"

#define SHARED_ROWS "renderer/techniques/raytraced.def"
#include "renderer/shared/rows_c.h"

struct denoised {
    uint32_t samples;
    uint32_t refine;
    float budget;
    uint32_t seed;
    uint32_t backend;
};

static const struct pen_param rows[] = {
    PARAM(struct denoised, samples, .def = 4, .min = 1, .max = 64,
        .help = "Shadow rays per pixel near a penumbra, rounded up to a power of two."),
    PARAM(struct denoised, refine, .def = 16, .min = 0, .max = 1024,
        .help = "More rays where the penumbra is too narrow to be filtered; 0: none."),
    PARAM(struct denoised, budget, .def = 3, .min = 0, .max = 1024, .unit = "rays",
        .help = "Of those rays, per pixel of the picture at most: in hair and foliage each pixel "
                "gets fewer."),
    SEED_ROW(struct denoised),
    BACKEND_ROW(struct denoised, "cpu: rays by Embree where it is built in, and the filter; gpu: "
                                 "as many rays in compute shaders, unfiltered; "),
};

struct state {
    struct ray_targets targets;
    bool settled;
};

static void destroy(struct technique_ctx *ctx, void *state)
{
    struct state *s = state;
    (void)ctx;
    ray_targets_finish(&s->targets);
}

static bool settle(struct technique_run *run, struct pen_error *error)
{
    struct state *s = run->state;
    struct pass_texture traced = {
        UNIT_TRACED, s->targets.visibility.texture.name, GL_SAMPLE_NEAREST};
    return pass_screen(run,
        &(struct pass_screen){.name = "trace resolve",
            .body = "raytraced.glsl",
            .defines = "#define BY_AREA\n",
            .textures = &traced,
            .texture_count = 1},
        error);
}

static bool trace(struct technique_run *run, struct pen_error *error)
{
    const struct denoised *params = run->params;
    struct state *s = run->state;
    const struct ray_denoising how = {params->samples, params->refine, params->budget};
    struct ray_job job = {.samples = params->samples + params->refine,
        .adaptive = run->face->extent[0] > 0,
        .seed = ray_seed(run, params->seed),
        .denoising = &how,
        .settle = settle};
    return pass_rays(run, params->backend, &job, &s->targets, &s->settled, error);
}

static bool record(struct technique_run *run, struct pen_error *error)
{
    struct state *s = run->state;
    /* A light is traced once; where the device does it, each face then takes its own receivers. */
    if (run->face == &run->light->faces[0] && !trace(run, error))
        return false;
    run->work_counted = true;
    return s->settled || settle(run, error);
}

const struct technique technique_denoised = {
    .info = {.name = "denoised",
        .title = "Few shadow rays and a filter",
        .summary = "A few rays per pixel where the light is partly hidden, more where the penumbra "
                   "is narrow, and a filter on the screen as wide as the blockers allow.",
        .citation = "S. Mehta, B. Wang, R. Ramamoorthi, Axis-aligned filtering for interactive "
                    "sampled soft shadows, SIGGRAPH Asia 2012; this variant is penumbra's own",
        .artefacts = "Noise in hair, foliage and at contacts, where nothing can be filtered; what "
                     "hides less than a sixteenth of the light may be missed.",
        .cost_class = PEN_COST_MEDIUM,
        .textured = true,
        .struct_size = sizeof(struct denoised),
        .params = {rows, sizeof rows / sizeof *rows}},
    .counts_horizon = true,
    .state_size = sizeof(struct state),
    .sketch = "samples=1 refine=0",
    .record = record,
    .destroy = destroy,
};
