#include "renderer/passes/draw/show.h"
#include "renderer/techniques/sample_params.h"
#include <string.h>

#define MAX_SAMPLES 1024
#define FIRST_MAPS 4 /* soon shown */

struct multisample {
    uint32_t samples;
    uint32_t map_size;
    uint32_t weighting;
    float bias;
};

static const struct pen_param rows[] = {
    PARAM(struct multisample, samples, .def = 256, .min = 1, .max = MAX_SAMPLES,
        .help = "Points on the light, each with a shadow map of its own."),
    MAP_SIZE_ROW(struct multisample, 1024),
    WEIGHTING_ROW(struct multisample),
    BIAS_ROW(struct multisample),
};

static bool settle(struct technique_run *run, const struct gl_target *sum, struct pen_error *error)
{
    struct pass_texture summed = {UNIT_SOURCE, sum->texture.name, GL_SAMPLE_NEAREST};
    return pass_screen(run,
        &(struct pass_screen){.name = "multisample resolve",
            .body = "multisample_resolve.glsl",
            .textures = &summed,
            .texture_count = 1},
        error);
}

static bool record(struct technique_run *run, struct pen_error *error)
{
    const struct multisample *params = run->params;
    struct sample_point points[MAX_SAMPLES];
    sample_sequence(run->face, 0, params->samples, points);
    if (params->samples == 1) /* a point light's shadow is expected */
        points[0] = sample_point_at(run->face, 0, 0);
    uint64_t bytes = (uint64_t)params->samples * params->map_size * params->map_size * 4;
    bool keep = bytes <= run->ctx->shadow_budget;
    const struct gl_target *sum = pass_sum(run);
    run->map_size = run->bound.map_size = params->map_size;
    run->bound.texels = 2;
    for (uint32_t first = 0, n; first < params->samples; first += n) {
        uint32_t left = params->samples - first,
                 most = first ? SAMPLE_MAP_BATCH - first % SAMPLE_MAP_BATCH : FIRST_MAPS;
        n = left < most ? left : most;
        struct sample_batch batch = {"multisample lookup", points + first, n, params->map_size,
            first, keep, params->samples};
        if (!sample_batch_add(run, &batch, sum, error))
            return false;
        enum technique_step step = pass_step(run, first + n, params->samples);
        if (step == STEP_STOP)
            break;
        if (step == STEP_SHOW && !(settle(run, sum, error) && pass_show(run, error)))
            return false;
    }
    return settle(run, sum, error);
}

const struct technique technique_multisample = {
    .info = {.name = "multisample",
        .title = "Multi-sampled area light",
        .summary = "Averages hard shadows from many points of the light, each with an off-axis "
                   "shadow map; converges to the true visibility.",
        .citation = "P. Heckbert, M. Herf, Simulating soft shadows with graphics hardware, "
                    "CMU-CS-97-104, 1997",
        .artefacts = "Bands at few samples; texels of each map; cost grows with the samples.",
        .cost_class = PEN_COST_REFERENCE,
        .textured = true,
        .candidates = PEN_CANDIDATES("samples=64", "samples=256"),
        .candidates_need_gpu = true,
        .struct_size = sizeof(struct multisample),
        .params = {rows, sizeof rows / sizeof *rows}},
    .counts_horizon = true,
    .record = record,
};
