#include "renderer/techniques/convolution_params.h"

struct cssm {
    uint32_t map_size;
    float bias;
    uint32_t search_taps;
    uint32_t taps;
    float min_filter;
    uint32_t terms;
    float damping;
    float offset;
    pen_flag contact;
    uint32_t storage;
};

static const struct pen_param rows[] = {
    MAP_SIZE_ROW(struct cssm, 1024),
    BIAS_ROW(struct cssm),
    PARAM(struct cssm, search_taps, .def = 2, .min = 1, .max = 8,
        .help = "Lookups per axis of the blocker average."),
    PARAM(struct cssm, taps, .def = 3, .min = 1, .max = 8,
        .help = "Lookups per axis of the filter; 1: a single one, as wide as the penumbra."),
    PARAM(struct cssm, min_filter, .def = 1, .min = 0, .max = 16, .unit = "texel",
        .help = "Least half width of the filter."),
    CONVOLUTION_ROWS(struct cssm, 16, CONVOLUTION_RGBA16),
};

static bool record(struct technique_run *run, struct pen_error *error)
{
    const struct cssm *params = run->params;
    struct convolution_desc desc = CONVOLUTION_DESC(params, true);
    return convolution_screen(run, &desc, (struct pass_screen){.name = "cssm", .body = "cssm.glsl"},
        1.5f * params->min_filter + 1, error);
}

const struct technique technique_cssm = {
    .info = {.name = "cssm",
        .title = "Convolution soft shadow maps",
        .summary = "Finds the average blocker depth and filters over the width that follows from "
                   "it, both by lookups in prefiltered Fourier series of the depth test.",
        .citation = "T. Annen, Z. Dong, T. Mertens, P. Bekaert, H.-P. Seidel, J. Kautz, Real-time, "
                    "all-frequency shadows in dynamic scenes, ACM Trans. Graph. 27(3), 2008",
        .artefacts = "Ripples at few terms, with specks where a surface shadows itself closely; "
                     "light seeps in near "
                     "contacts of curved casters; one average depth merges near and far "
                     "casters." BLENDED_GRAIN,
        .cost_class = PEN_COST_MEDIUM,
        .textured = false,
        .struct_size = sizeof(struct cssm),
        .params = {rows, sizeof rows / sizeof *rows}},
    .sketch = "map_size=256",
    .record = record,
};
