#include "renderer/techniques/moment_params.h"

struct vsm {
    uint32_t map_size;
    float bias;
    uint32_t blur;
    float min_variance;
    float bleed;
    pen_flag bounded;
};

static const struct pen_param rows[] = {
    MAP_SIZE_ROW(struct vsm, 1024),
    BIAS_ROW(struct vsm),
    BLUR_ROW(struct vsm),
    PARAM(struct vsm, min_variance, .def = 1e-5, .min = 0, .max = 0.01,
        .help = "Least variance of depth, in squares of the map's depth range."),
    PARAM(struct vsm, bleed, .def = 0.2, .min = 0, .max = 0.9,
        .help = "Visibility that counts as none; cuts light bleeding and narrows edges."),
    BOUNDED_ROW(struct vsm),
};

static bool record(struct technique_run *run, struct pen_error *error)
{
    const struct vsm *params = run->params;
    struct moment_map desc = {
        .kind = MOMENTS_VARIANCE, .size = params->map_size, .blur = params->blur};
    return moment_screen(run, &desc, params->bounded.on, "vsm", "vsm.glsl", error);
}

const struct technique technique_vsm = {
    .info = {.name = "vsm",
        .title = "Variance shadow map",
        .summary = "Blurs depth and its square in the map and bounds the share of light with "
                   "Chebyshev's inequality.",
        .citation = "W. Donnelly, A. Lauritzen, Variance shadow maps, I3D 2006",
        .artefacts = "Light bleeds where a second caster lies behind the edge of the first; edges "
                     "have the width of the blur whatever the light." BLENDED_GRAIN,
        .cost_class = PEN_COST_CHEAP,
        .textured = false,
        .struct_size = sizeof(struct vsm),
        .params = {rows, sizeof rows / sizeof *rows}},
    .record = record,
};
