#include "renderer/techniques/convolution_params.h"

struct csm {
    uint32_t map_size;
    float bias;
    float radius;
    uint32_t taps;
    uint32_t terms;
    float damping;
    float offset;
    pen_flag contact;
    uint32_t storage;
    pen_flag raw;
};

static const struct pen_param rows[] = {
    MAP_SIZE_ROW(struct csm, 1024),
    BIAS_ROW(struct csm),
    PARAM(struct csm, radius, .def = 3, .min = 0.5, .max = 256, .unit = "texel",
        .help = "Half width of the filter."),
    PARAM(struct csm, taps, .def = 2, .min = 1, .max = 8,
        .help = "Lookups per axis that make up the square filter."),
    CONVOLUTION_ROWS(struct csm, 8, CONVOLUTION_RGBA16),
    RAW_ROW(struct csm),
};

static bool record(struct technique_run *run, struct pen_error *error)
{
    const struct csm *params = run->params;
    struct convolution_desc desc = CONVOLUTION_DESC(params, false);
    return convolution_screen(run, &desc,
        (struct pass_screen){
            .name = "csm", .body = "csm.glsl", .defines = params->raw.on ? "#define RAW\n" : NULL},
        params->raw.on ? -1 : 1.5f * params->radius + 1, error);
}

const struct technique technique_csm = {
    .info = {.name = "csm",
        .title = "Convolution shadow maps",
        .summary = "Writes the depth test as a Fourier series, whose terms are filtered like any "
                   "texture, and averages it over a fixed square of the map.",
        .citation = "T. Annen, T. Mertens, P. Bekaert, H.-P. Seidel, J. Kautz, Convolution shadow "
                    "maps, Eurographics Symposium on Rendering 2007",
        .artefacts = "The width of the edge is that of the filter, whatever the light; ripples at "
                     "few terms; light seeps in near contacts of curved casters." BLENDED_GRAIN,
        .cost_class = PEN_COST_CHEAP,
        .textured = false,
        .struct_size = sizeof(struct csm),
        .params = {rows, sizeof rows / sizeof *rows}},
    .sketch = "map_size=256",
    .record = record,
};
