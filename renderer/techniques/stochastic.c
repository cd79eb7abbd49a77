#include "renderer/passes/filter/light_samples.h"
#include "renderer/techniques/penumbra_params.h"

struct stochastic {
    uint32_t samples;
    uint32_t maps;
    uint32_t map_size;
    float bias;
    uint32_t search_taps;
    float min_filter;
    uint32_t levels;
    float blur;
    uint32_t max_radius;
    float depth_sigma;
    uint32_t normal_power;
};

static const struct pen_param rows[] = {
    PARAM(struct stochastic, samples, .def = 4, .min = 1, .max = 16,
        .help = "Light samples per pixel and frame."),
    PARAM(struct stochastic, maps, .def = 32, .min = 1, .max = LIGHT_SAMPLES_MOST,
        .help = "Shadow maps, each from a point of the light, that pixels choose from."),
    MAP_SIZE_ROW(struct stochastic, 1024),
    BIAS_ROW(struct stochastic),
    PENUMBRA_ROWS(struct stochastic, 12),
    PARAM(struct stochastic, levels, .def = 2, .min = 0, .max = 6,
        .help = "Levels of the a-trous filter; each doubles its reach."),
    PARAM(struct stochastic, blur, .def = 0.6, .min = 0, .max = 4,
        .help = "Width of the filter over that of the penumbra."),
    FILTER_ROWS(struct stochastic),
};

static bool record(struct technique_run *run, struct pen_error *error)
{
    const struct stochastic *params = run->params;
    return pass_penumbra_spread(run, params->map_size, params->min_filter, error) &&
           pass_light_samples(run, params->maps, params->map_size, params->samples, error) &&
           pass_penumbra_atrous(run, params->levels, error);
}

const struct technique technique_stochastic = {
    .info = {.name = "stochastic",
        .title = "Stochastic light samples with denoising",
        .summary = "A few light samples per pixel, different ones in neighbouring pixels, and an "
                   "edge-avoiding filter bounded by the width of the penumbra.",
        .citation = "S. Mehta, B. Wang, R. Ramamoorthi, Axis-aligned filtering for interactive "
                    "sampled soft shadows, ACM TOG 31(6), 2012; H. Dammertz, D. Sewtz, J. Hanika, "
                    "H. Lensch, Edge-avoiding a-trous wavelet transform, HPG 2010",
        .artefacts = "Grain in narrow penumbrae and on small features, which antialiasing frames "
                     "average out; steps of the maps where the penumbra is wider than the "
                     "filter." BLENDED_GRAIN,
        .cost_class = PEN_COST_MEDIUM,
        .textured = true,
        .struct_size = sizeof(struct stochastic),
        .params = {rows, sizeof rows / sizeof *rows}},
    .counts_horizon = true,
    .sketch = "maps=4 samples=4 map_size=256",
    .record = record,
};
