#include "renderer/passes/map/classify.h"
#include "renderer/passes/filter/interleave.h"
#include "renderer/passes/map/sat.h"
#include "renderer/techniques/map_params.h"

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
};

static const struct pen_param rows[] = {
    MAP_SIZE_ROW(struct vssm, 1024),
    BIAS_ROW(struct vssm),
    PARAM(struct vssm, subdivide, .choices = subdivide_names, .specialise = 1,
        .help = "Splits windows that mean and variance do not describe: where needed, always, or "
                "never."),
    PARAM(struct vssm, levels, .def = 1, .min = 1, .max = 4, .specialise = 1,
        .help = "Times a window is halved at most."),
    PARAM(struct vssm, leaf_grid, .def = 2, .min = 1, .max = 4, .specialise = 1,
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
    PARAM(struct vssm, min_filter, .def = 1, .min = 0.5, .max = 16, .unit = "texel",
        .help = "Least half width of a window."),
    PARAM(struct vssm, max_window, .def = 128, .min = 40, .max = 512, .unit = "texel",
        .help = "Width of the widest window: the table is halved until the light's search fits."),
};

static bool record(struct technique_run *run, struct pen_error *error)
{
    const struct vssm *params = run->params;
    struct sat_table table = {
        .kind = SAT_VARIANCE, .map_size = params->map_size, .max_window = params->max_window};
    struct sat_block block;
    const struct shadow_input *map = pass_depth_map(run, params->map_size, error);
    const struct shadow_input *min_max = map ? pass_min_max(run, params->map_size, error) : NULL;
    const struct shadow_input *sat = min_max ? pass_sat(run, &table, &block, error) : NULL;
    const struct gl_texture *tiles;
    if (!sat || !pass_lit_tiles(run, params->map_size, params->min_filter + 1, 0, &tiles, error))
        return false;
    struct pass_texture textures[] = {{UNIT_FREE + 1, sat->textures[0].name, GL_SAMPLE_NEAREST},
        {UNIT_MIN_MAX, min_max->textures[0].name, GL_SAMPLE_NEAREST}};
    struct pass_screen pass = {.name = "vssm",
        .body = "vssm.glsl",
        .shadow = &map->textures[0],
        .textures = textures,
        .texture_count = 2,
        .tiles = tiles,
        .extra = &block,
        .extra_bytes = sizeof block};
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
                     "square kernels; steps where split parts compare few depths.",
        .cost_class = PEN_COST_MEDIUM,
        .textured = false,
        .candidates = PEN_CANDIDATES(""),
        .struct_size = sizeof(struct vssm),
        .params = {rows, sizeof rows / sizeof *rows}},
    .record = record,
};
