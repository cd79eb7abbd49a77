#include "renderer/passes/filter/light_samples.h"
#include "renderer/techniques/penumbra_params.h"

struct bilateral {
    uint32_t samples;
    uint32_t map_size;
    float bias;
    uint32_t search_taps;
    float min_filter;
    uint32_t filter_taps;
    float sigma;
    uint32_t max_radius;
    float depth_sigma;
    uint32_t normal_power;
};

static const struct pen_param rows[] = {
    PARAM(struct bilateral, samples, .def = 25, .min = 1, .max = LIGHT_SAMPLES_MOST,
        .help = "Points on the light, each with a shadow map of its own."),
    MAP_SIZE_ROW(struct bilateral, 1024),
    BIAS_ROW(struct bilateral),
    PENUMBRA_ROWS(struct bilateral, 12),
    GAUSS_ROWS(struct bilateral, 4, 0.15),
    FILTER_ROWS(struct bilateral),
};

static bool record(struct technique_run *run, struct pen_error *error)
{
    const struct bilateral *params = run->params;
    return pass_penumbra_spread(run, params->map_size, params->min_filter, error) &&
           pass_light_samples(run, params->samples, params->map_size, params->samples, error) &&
           pass_penumbra_gauss(run, PENUMBRA_SAMPLES, error);
}

const struct technique technique_bilateral = {
    .info = {.name = "bilateral",
        .title = "Screen-space bilateral filtering of few light samples",
        .summary = "Averages hard shadows from a few points of the light and smooths their bands "
                   "by a filter over the penumbra that respects depth and normal.",
        .citation = "H. Ali, H. Kolivand, M. Sunar, Soft bilateral filtering shadows using "
                    "multiple image-based algorithms, Multimedia Tools and Applications, 2017",
        .artefacts = "Bands where the filter is narrower than the steps between samples; soft ends "
                     "of the penumbra where it is wider." BLENDED_GRAIN,
        .cost_class = PEN_COST_HEAVY,
        .textured = true,
        .candidates = PEN_CANDIDATES(""),
        .struct_size = sizeof(struct bilateral),
        .params = {rows, sizeof rows / sizeof *rows}},
    .counts_horizon = true,
    .sketch = "samples=4 map_size=256 search_taps=4",
    .record = record,
};
