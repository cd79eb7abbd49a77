#include "renderer/passes/filter/penumbra.h"
#include "renderer/techniques/penumbra_params.h"

struct screen_space {
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
    MAP_SIZE_ROW(struct screen_space, 2048),
    BIAS_ROW(struct screen_space),
    PENUMBRA_ROWS(struct screen_space, 16),
    GAUSS_ROWS(struct screen_space, 12, 1),
    FILTER_ROWS(struct screen_space),
};

static bool record(struct technique_run *run, struct pen_error *error)
{
    const struct screen_space *params = run->params;
    return pass_penumbra_spread(run, params->map_size, params->min_filter, error) &&
           pass_penumbra_gauss(run, PENUMBRA_HARD, error);
}

const struct technique technique_screen_space = {
    .info = {.name = "screen-space",
        .title = "Screen-space blurred shadows",
        .summary = "Hard shadows on the screen, blurred by a separable Gaussian as wide as the "
                   "penumbra of each pixel, over the pixel's own surface.",
        .citation = "J. Gumbau, M. Chover, M. Sbert, Screen space soft shadows, GPU Pro, 2010; "
                    "M. MohammadBagher, J. Kautz, N. Holzschuch, C. Soler, Screen-space "
                    "percentage-closer soft shadows, SIGGRAPH 2010 posters",
        .artefacts = "Shadow edges off the screen or behind an object are missing from the blur, "
                     "so penumbrae end at silhouettes; the light is a Gaussian." BLENDED_GRAIN,
        .cost_class = PEN_COST_MEDIUM,
        .textured = false,
        .struct_size = sizeof(struct screen_space),
        .params = {rows, sizeof rows / sizeof *rows}},
    .sketch = "map_size=512 search_taps=4 filter_taps=4",
    .record = record,
};
