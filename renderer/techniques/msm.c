#include "renderer/techniques/moment_params.h"

struct msm {
    uint32_t map_size;
    float bias;
    uint32_t blur;
    uint32_t precision;
    float moment_bias;
    float bleed;
    pen_flag bounded;
};

static const char *const precision_names[] = {"float32", "unorm16", NULL};

static const struct pen_param rows[] = {
    MAP_SIZE_ROW(struct msm, 1024),
    BIAS_ROW(struct msm),
    BLUR_ROW(struct msm),
    PARAM(struct msm, precision, .choices = precision_names, .specialise = 1,
        .help = "Numbers of the moment map: 16 or 8 bytes a texel."),
    PARAM(struct msm, moment_bias, .def = 0, .min = 0, .max = 0.01,
        .help = "Share of a spread-out distribution mixed in against rounding; 0: by precision."),
    PARAM(struct msm, bleed, .def = 0, .min = 0, .max = 0.9,
        .help = "Visibility that counts as none; cuts light bleeding and narrows edges."),
    BOUNDED_ROW(struct msm),
};

static bool record(struct technique_run *run, struct pen_error *error)
{
    const struct msm *params = run->params;
    struct moment_map desc = {.kind = params->precision ? MOMENTS_FOUR_UNORM : MOMENTS_FOUR,
        .size = params->map_size,
        .blur = params->blur};
    return moment_screen(run, &desc, params->bounded.on, "msm", "msm.glsl", error);
}

const struct technique technique_msm = {
    .info = {.name = "msm",
        .title = "Moment shadow map",
        .summary = "Blurs four powers of depth in the map and takes the least shadow that these "
                   "moments allow (Hamburger moment problem).",
        .citation = "C. Peters, R. Klein, Moment shadow mapping, I3D 2015",
        .artefacts = "Light bleeds a little where three or more casters lie behind each other; "
                     "edges have the width of the blur whatever the light." BLENDED_GRAIN,
        .cost_class = PEN_COST_CHEAP,
        .textured = false,
        .struct_size = sizeof(struct msm),
        .params = {rows, sizeof rows / sizeof *rows}},
    .record = record,
};
