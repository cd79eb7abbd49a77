#include "renderer/techniques/moment_params.h"

struct evsm {
    uint32_t map_size;
    float bias;
    uint32_t blur;
    float positive_exponent;
    float negative_exponent;
    float min_deviation;
    float bleed;
    pen_flag bounded;
};

static const struct pen_param rows[] = {
    MAP_SIZE_ROW(struct evsm, 1024),
    BIAS_ROW(struct evsm),
    BLUR_ROW(struct evsm),
    PARAM(struct evsm, positive_exponent, .def = 40, .min = 0.1, .max = 42,
        .help = "Strength of the warp that separates blockers from what lies behind them."),
    PARAM(struct evsm, negative_exponent, .def = 5, .min = 0.1, .max = 42,
        .help = "Strength of the opposite warp, which repairs contacts."),
    PARAM(struct evsm, min_deviation, .def = 0.0005, .min = 0, .max = 0.1,
        .help = "Least standard deviation of depth, in halves of the map's depth range."),
    PARAM(struct evsm, bleed, .def = 0, .min = 0, .max = 0.9,
        .help = "Visibility that counts as none; cuts light bleeding and narrows edges."),
    BOUNDED_ROW(struct evsm),
};

static bool record(struct technique_run *run, struct pen_error *error)
{
    const struct evsm *params = run->params;
    struct moment_map desc = {
        .kind = MOMENTS_EXPONENTIAL, .size = params->map_size, .blur = params->blur};
    desc.exponents[0] = params->positive_exponent;
    desc.exponents[1] = params->negative_exponent;
    return moment_screen(run, &desc, params->bounded.on, "evsm", "evsm.glsl", error);
}

const struct technique technique_evsm = {
    .info = {.name = "evsm",
        .title = "Exponential variance shadow map",
        .summary = "A variance shadow map of depth under two exponential warps; the smaller of "
                   "both bounds is the visibility.",
        .citation = "A. Lauritzen, M. McCool, Layered variance shadow maps, Graphics Interface "
                    "2008",
        .artefacts =
            "Some light bleeds between casters that are close together in depth; sloped "
            "receivers lose contact within the width of the blur; 16 bytes a texel." BLENDED_GRAIN,
        .cost_class = PEN_COST_CHEAP,
        .textured = false,
        .struct_size = sizeof(struct evsm),
        .params = {rows, sizeof rows / sizeof *rows}},
    .record = record,
};
