#include "renderer/passes/draw/kept_sums.h"
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

static bool look_up(struct technique_run *run, const struct gl_target *sum, uint32_t done,
    bool *enough, struct pen_error *error)
{
    enum technique_step step =
        pass_step(run, done, ((const struct multisample *)run->params)->samples);
    *enough = step == STEP_STOP;
    return step != STEP_SHOW || (settle(run, sum, error) && pass_show(run, error));
}

/* More samples would come in whole batches: what is less goes into a copy. The order of additions,
 * and so the picture, is then the same whoever took the samples before. */
static const struct gl_target *copy_sum(struct technique_run *run, const struct gl_target *from)
{
    const struct gl_target *to = pass_sum(run);
    gl.CopyImageSubData(from->texture.name, GL_TEXTURE_2D, 0, 0, 0, 0, to->texture.name,
        GL_TEXTURE_2D, 0, 0, 0, 0, (GLsizei)run->width, (GLsizei)run->height, 1);
    return to;
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
    struct kept_sum *kept =
        kept_sum_open(run, params->samples, 1, (uint64_t)KEPT_SUM_BYTES * run->width * run->height);
    const struct gl_target *sum = kept ? kept_sum_target(run, kept) : pass_sum(run);
    uint32_t done = kept ? kept->samples : 0;
    bool enough = false;
    run->result->shadow_maps += done;
    run->map_size = run->bound.map_size = params->map_size;
    run->bound.texels = 2;
    if (done && !look_up(run, sum, done, &enough, error))
        return false;
    while (done < params->samples && !enough) {
        uint32_t left = params->samples - done,
                 most = done ? SAMPLE_MAP_BATCH - done % SAMPLE_MAP_BATCH : FIRST_MAPS;
        uint32_t n = left < most ? left : most;
        if (kept && n < most) {
            sum = copy_sum(run, sum);
            kept = NULL;
        }
        struct sample_batch batch = {
            "multisample lookup", points + done, n, params->map_size, keep, 1};
        if (kept)
            kept->samples = 0;
        if (!sample_batch_add(run, &batch, sum, error))
            return false;
        done += n;
        if (kept)
            kept->samples = done;
        if (!look_up(run, sum, done, &enough, error))
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
        .artefacts =
            "Bands at few samples; texels of each map; cost grows with the samples." BLENDED_GRAIN,
        .cost_class = PEN_COST_REFERENCE,
        .textured = true,
        .candidates = PEN_CANDIDATES("samples=64", "samples=256"),
        .candidates_need_gpu = true,
        .struct_size = sizeof(struct multisample),
        .params = {rows, sizeof rows / sizeof *rows}},
    .counts_horizon = true,
    .keeps_sums = true,
    .record = record,
};
