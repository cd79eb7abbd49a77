#include "renderer/techniques/sat_params.h"

struct mssm {
    uint32_t map_size;
    float bias;
    float kernel_bias;
    int32_t parts;
    float moment_bias;
    float bleed;
    float min_filter;
    uint32_t max_window;
    pen_flag bounded;
};

static const struct pen_param rows[] = {
    MAP_SIZE_ROW(struct mssm, 1024),
    BIAS_ROW(struct mssm),
    PARAM(struct mssm, kernel_bias, .def = 0, .min = 0, .max = 1,
        .help = "Share of a sloped receiver's depth within the window that its bias follows."),
    PARAM(struct mssm, parts, .def = 2, .min = 1, .max = 4,
        .help =
            "Parts per side of a window, each with moments of its own; 1: the published method."),
    PARAM(struct mssm, moment_bias, .def = 6e-6, .min = 0, .max = 0.01,
        .help = "Share of a spread-out distribution mixed in against rounding."),
    PARAM(struct mssm, bleed, .def = 0, .min = 0, .max = 0.9,
        .help = "Visibility that counts as none; cuts light bleeding and narrows penumbrae."),
    SAT_ROWS(struct mssm, 256),
    BOUNDED_ROW(struct mssm),
};

static bool record(struct technique_run *run, struct pen_error *error)
{
    const struct mssm *params = run->params;
    struct sat_table table = {
        .kind = SAT_FOUR_MOMENTS, .map_size = params->map_size, .max_window = params->max_window};
    struct sat_lookup lookup;
    if (!sat_prepare(run, &table, params->min_filter, params->bounded.on, &lookup, error))
        return false;
    return pass_screen(run,
        &(struct pass_screen){.name = "mssm",
            .body = "mssm.glsl",
            .textures = lookup.textures,
            .texture_count = 2,
            .tiles = lookup.tiles,
            .extra = &lookup.block,
            .extra_bytes = sizeof lookup.block},
        error);
}

const struct technique technique_mssm = {
    .info = {.name = "mssm",
        .title = "Moment soft shadow mapping",
        .summary = "Percentage-closer soft shadows whose blocker search and filter each take a few "
                   "reads of a summed-area table of four powers of depth.",
        .citation = "C. Peters, C. Muenstermann, N. Wetzstein, R. Klein, Improved moment shadow "
                    "maps for translucent occluders, soft shadows and single scattering, JCGT 2017",
        .artefacts = "Light bleeds a little where three or more casters lie behind each other; "
                     "contacts on sloped receivers brighten; square kernels." BLENDED_GRAIN,
        .cost_class = PEN_COST_MEDIUM,
        .textured = false,
        .candidates = PEN_CANDIDATES(""),
        .struct_size = sizeof(struct mssm),
        .params = {rows, sizeof rows / sizeof *rows}},
    .sketch = "map_size=256",
    .record = record,
};
