#include "renderer/passes/draw/screen.h"
#include "renderer/techniques/ray_params.h"

#define SHARED_ROWS "renderer/techniques/raytraced.def"
#include "renderer/shared/rows_c.h"

static const char *const weighting_names[] = {"area", "g", NULL};

struct raytraced {
    uint32_t samples;
    uint32_t weighting;
    pen_flag adaptive;
    float target_error;
    uint32_t seed;
    uint32_t backend;
};

static const struct pen_param rows[] = {
    PARAM(struct raytraced, samples, .def = 256, .min = 1, .max = 65536,
        .help = "Shadow rays per pixel at most, rounded up to a power of two."),
    PARAM(struct raytraced, weighting, .choices = weighting_names, .specialise = 1,
        .help = "Mean over the light's area, or weighted by each point's irradiance."),
    PARAM(struct raytraced, adaptive, .def = 1,
        .help = "Spends all rays only near pixels whose first 16 disagree."),
    PARAM(struct raytraced, target_error, .def = 0, .min = 0, .max = 0.5,
        .help = "Stops when a pixel's standard error is below; 0 spends all rays."),
    SEED_ROW(struct raytraced),
    BACKEND_ROW(struct raytraced, "Where rays are traced: gpu in compute shaders, cpu by Embree "
                                  "where it is built in; "),
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
    struct pass_texture traced[] = {
        {UNIT_TRACED, s->targets.visibility.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_TRACED_ERROR, s->targets.standard_error.texture.name, GL_SAMPLE_NEAREST}};
    return pass_screen(run,
        &(struct pass_screen){.name = "trace resolve",
            .body = "raytraced.glsl",
            .textures = traced,
            .texture_count = 2},
        error);
}

static bool trace(struct technique_run *run, struct pen_error *error)
{
    const struct raytraced *params = run->params;
    struct state *s = run->state;
    struct ray_job job = {.samples = params->samples,
        .target_error = params->target_error,
        .weighting = params->weighting,
        .adaptive = params->adaptive.on && run->face->extent[0] > 0,
        .seed = ray_seed(run, params->seed),
        .settle = settle};
    return pass_rays(run, params->backend, &job, &s->targets, &s->settled, error);
}

static bool record(struct technique_run *run, struct pen_error *error)
{
    struct state *s = run->state;
    /* A light is traced once; each face then takes its own receivers. */
    if (run->face == &run->light->faces[0] && !trace(run, error))
        return false;
    run->work_counted = true;
    if (!s->settled && !settle(run, error))
        return false;
    if (!run->variance_framebuffer)
        return true;
    struct pass_texture traced = {
        UNIT_TRACED_ERROR, s->targets.standard_error.texture.name, GL_SAMPLE_NEAREST};
    return pass_screen(run,
        &(struct pass_screen){.name = "trace variance",
            .body = "raytraced.glsl",
            .defines = "#define VARIANCE\n",
            .textures = &traced,
            .texture_count = 1,
            .framebuffer = run->variance_framebuffer,
            .add = true},
        error);
}

const struct technique technique_raytraced = {
    .info = {.name = "raytraced",
        .title = "Ray-traced area light",
        .summary =
            "Shadow rays from every pixel to points of the light: the reference, independent "
            "of any shadow map.",
        .citation = "R. Cook, T. Porter, L. Carpenter, Distributed ray tracing, SIGGRAPH 1984; "
                    "I. Wald et al., Embree, SIGGRAPH 2014",
        .artefacts = "Fine noise at few samples; facets of coarse meshes shadow themselves at the "
                     "terminator.",
        .cost_class = PEN_COST_REFERENCE,
        .textured = true,
        .candidates =
            PEN_CANDIDATES("samples=16 seed=1", "samples=64 seed=1", "samples=256 seed=1"),
        .struct_size = sizeof(struct raytraced),
        .params = {rows, sizeof rows / sizeof *rows}},
    .counts_horizon = true,
    .keeps_sums = true,
    .state_size = sizeof(struct state),
    .estimates_error = true,
    .record = record,
    .destroy = destroy,
};
