#include "renderer/passes/filter/interleave.h"
#include "renderer/passes/map/depth_map.h"
#include "renderer/techniques/sat_params.h"

static const char *const subdivide_names[] = {"quadtree", "uniform", "off", NULL};

struct vssm {
    uint32_t map_size;
    float bias;
    uint32_t subdivide;
    int32_t levels;
    int32_t leaf_grid;
    float tolerance;
    pen_flag smooth;
    float min_variance;
    float bleed;
    float min_filter;
    uint32_t max_window;
    pen_flag bounded;
};

static const struct pen_param rows[] = {
    MAP_SIZE_ROW(struct vssm, 1024),
    BIAS_ROW(struct vssm),
    PARAM(struct vssm, subdivide, .choices = subdivide_names, .specialise = 1,
        .help = "Splits windows that mean and variance do not describe: where needed, always, or "
                "never."),
    PARAM(struct vssm, levels, .def = 1, .min = 1, .max = 4,
        .help = "Times a window is halved at most."),
    PARAM(struct vssm, leaf_grid, .def = 2, .min = 1, .max = 4,
        .help = "Side of the grid of depth comparisons in a part that cannot be split further."),
    PARAM(struct vssm, tolerance, .def = 0.2, .min = 0, .max = 1000,
        .help = "How far a part may be from two planes, relative to their distance, before it is "
                "split."),
    PARAM(struct vssm, smooth, .def = 1, .specialise = 1,
        .help = "Shifts comparisons per pixel and averages 4 x 4 pixels of wide penumbrae."),
    PARAM(struct vssm, min_variance, .def = 1e-5, .min = 0, .max = 0.01,
        .help = "Least variance of depth, in squares of the map's depth range."),
    PARAM(struct vssm, bleed, .def = 0, .min = 0, .max = 0.9,
        .help = "Visibility that counts as none; cuts light bleeding and narrows penumbrae."),
    SAT_ROWS(struct vssm, 512),
    BOUNDED_ROW(struct vssm),
};

static bool record(struct technique_run *run, struct pen_error *error)
{
    const struct vssm *params = run->params;
    struct sat_table table = {
        .kind = SAT_VARIANCE, .map_size = params->map_size, .max_window = params->max_window};
    struct sat_lookup lookup;
    const struct shadow_input *map = pass_depth_map(run, params->map_size, error);
    if (!map || !sat_prepare(run, &table, params->min_filter, params->bounded.on, &lookup, error))
        return false;
    struct pass_screen pass = {.name = "vssm",
        .body = "vssm.glsl",
        .shadow = &map->textures[0],
        .textures = lookup.textures,
        .texture_count = 2,
        .tiles = lookup.tiles,
        .extra = &lookup.block,
        .extra_bytes = sizeof lookup.block};
    return params->smooth.on ? pass_interleaved(run, &pass, error) : pass_screen(run, &pass, error);
}

const struct technique technique_vssm = {
    .info = {.name = "vssm",
        .title = "Variance soft shadow mapping",
        .summary = "Percentage-closer soft shadows whose blocker search and filter each take a few "
                   "reads of a summed-area table of depth and its square, whatever their width.",
        .citation = "B. Yang, Z. Dong, J. Feng, H.-P. Seidel, J. Kautz, Variance soft shadow "
                    "mapping, Pacific Graphics 2010",
        .artefacts = "Light bleeds where a second caster lies behind the first in a penumbra; "
                     "square kernels; steps where split parts compare few depths." BLENDED_GRAIN,
        .cost_class = PEN_COST_MEDIUM,
        .textured = false,
        .candidates = PEN_CANDIDATES(""),
        .struct_size = sizeof(struct vssm),
        .params = {rows, sizeof rows / sizeof *rows}},
    .sketch = "map_size=256",
    .record = record,
};
