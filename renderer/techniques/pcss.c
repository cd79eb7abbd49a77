#include "renderer/passes/map/classify.h"
#include "renderer/passes/filter/interleave.h"
#include "renderer/passes/map/depth_map.h"
#include "renderer/passes/map/min_max.h"
#include "renderer/passes/map/shadow_cache.h"
#include "renderer/techniques/map_params.h"

struct pcss {
    uint32_t map_size;
    float bias;
    uint32_t search_taps;
    uint32_t filter_taps;
    float min_filter;
    pen_flag smooth;
};

static const struct pen_param rows[] = {
    MAP_SIZE_ROW(struct pcss, 2048),
    BIAS_ROW(struct pcss),
    PARAM(struct pcss, search_taps, .def = 16, .min = 1, .max = 64,
        .help = "Samples used to find the average blocker depth."),
    PARAM(struct pcss, filter_taps, .def = 32, .min = 1, .max = 256,
        .help = "Depth comparisons of the filter."),
    PARAM(struct pcss, min_filter, .def = 1, .min = 0, .max = 16, .unit = "texel",
        .help = "Least half width of the filter."),
    PARAM(struct pcss, smooth, .def = 1, .specialise = 1,
        .help = "Shifts the taps per pixel and averages 4 x 4 pixels of wide penumbrae."),
};

static bool record(struct technique_run *run, struct pen_error *error)
{
    const struct pcss *params = run->params;
    const struct shadow_input *map = pass_caster_map(run, params->map_size, error);
    const struct shadow_input *min_max = pass_caster_min_max(run, params->map_size, error);
    if (!map || !min_max)
        return false;
    struct pass_texture pyramid = {UNIT_MIN_MAX, min_max->textures[0].name, GL_SAMPLE_NEAREST};
    struct classify_desc classes = {.map_size = params->map_size,
        .margin_texels = params->min_filter + 1,
        .umbra = true,
        .bound = BOUND_PLANE};
    const struct gl_texture *tiles;
    if (!pass_classify(run, &classes, &tiles, error))
        return false;
    struct pass_screen pass = {.name = "pcss",
        .body = "pcss.glsl",
        .shadow = &map->textures[0],
        .textures = &pyramid,
        .texture_count = 1,
        .tiles = tiles};
    return params->smooth.on ? pass_interleaved(run, &pass, error) : pass_screen(run, &pass, error);
}

const struct technique technique_pcss = {
    .info = {.name = "pcss",
        .title = "Percentage-closer soft shadows",
        .summary = "Finds the average blocker depth, derives the width of the penumbra from it and "
                   "filters depth comparisons over that width.",
        .citation = "R. Fernando, Percentage-closer soft shadows, SIGGRAPH 2005 sketches",
        .artefacts =
            "One average depth merges near and far casters: penumbrae of both are of a width "
            "between theirs; thin blockers can be missed by the search; "
            "seen from the centre of the light only; where a texel of the map covers many pixels, "
            "wide penumbrae of a near light have streaks of its width." BLENDED_GRAIN,
        .cost_class = PEN_COST_MEDIUM,
        .textured = false,
        .candidates = PEN_CANDIDATES("", "search_taps=32 filter_taps=64"),
        .struct_size = sizeof(struct pcss),
        .params = {rows, sizeof rows / sizeof *rows}},
    .sketch = "map_size=512 search_taps=4 filter_taps=8",
    .record = record,
};
