#include "renderer/passes/draw/turn.h"
#include "renderer/passes/map/classify.h"
#include "renderer/passes/filter/interleave.h"
#include "renderer/passes/map/depth_map.h"
#include "renderer/techniques/convolution_params.h"

static const char *const mode_names[] = {"adaptive", "fixed2", "average", NULL};
static const char *const estimator_names[] = {"csm", "pcf", NULL};
enum { ESTIMATOR_CSM, ESTIMATOR_PCF };

#define SHARED_ROWS "renderer/techniques/adaptive.def"
#include "renderer/shared/rows_c.h"

struct adaptive {
    uint32_t map_size;
    float bias;
    uint32_t mode;
    uint32_t estimator;
    float theta;
    float colour;
    float blend;
    float min_filter;
    uint32_t pcf_search_taps;
    uint32_t pcf_taps;
    pen_flag smooth;
    uint32_t series_size;
    uint32_t search_taps;
    uint32_t taps;
    uint32_t terms;
    float damping;
    float offset;
    pen_flag contact;
    uint32_t storage;
};

static const struct pen_param rows[] = {
    MAP_SIZE_ROW(struct adaptive, 2048),
    BIAS_ROW(struct adaptive),
    PARAM(struct adaptive, mode, .choices = mode_names, .specialise = 1,
        .help = "Splits where it pays; always into 16 cells; never."),
    PARAM(struct adaptive, estimator, .def = ESTIMATOR_PCF, .choices = estimator_names,
        .help = "Visibility of a cell: convolution shadow maps, as published, or comparisons."),
    PARAM(struct adaptive, theta, .def = 0.01, .min = -1, .max = 0.25,
        .help = "Least E - E^2 of a cell's visibility that splits it. 0.2244: as published; 0.25: "
                "colour alone decides; negative: always."),
    PARAM(struct adaptive, colour, .def = 0.05, .min = 0, .max = 10,
        .help = "Least standard deviation over mean of a cell's emission that splits it wherever "
                "it is partly visible, below theta, too; less than 0.04 is constant and never "
                "split. 0: visibility alone decides."),
    PARAM(struct adaptive, blend, .def = 0.02, .min = 0, .max = 0.25,
        .help = "Range of E - E^2 above theta over which a split fades in."),
    PARAM(struct adaptive, min_filter, .def = 1, .min = 0, .max = 16, .unit = "texel",
        .help = "Least half width of the filter."),
    PARAM(struct adaptive, pcf_search_taps, .def = 16, .min = 1, .max = 64,
        .help = "Estimator pcf: samples used to find the average blocker depth."),
    PARAM(struct adaptive, pcf_taps, .def = 32, .min = 4, .max = 256,
        .help = "Estimator pcf: depth comparisons of the whole filter, halved by each split."),
    PARAM(struct adaptive, smooth, .def = 1,
        .help = "Estimator pcf: shifts the comparisons per pixel and averages 4 x 4 pixels of wide "
                "penumbrae."),
    PARAM(struct adaptive, series_size, .def = 1024, .min = 64, .max = 8192, .unit = "texel",
        .help = "Estimator csm: side of the filtered maps, in place of map_size."),
    PARAM(struct adaptive, search_taps, .def = 2, .min = 1, .max = 8,
        .help = "Estimator csm: lookups per axis of the blocker average."),
    PARAM(struct adaptive, taps, .def = 4, .min = 1, .max = 8,
        .help = "Estimator csm: lookups per axis of the whole filter, halved by each split."),
    CONVOLUTION_ROWS(struct adaptive, 16, CONVOLUTION_RGBA16),
};

struct state {
    GLuint counts; /* struct adaptive_counts */
};

static bool create(struct technique_ctx *ctx, void *state, struct pen_error *error)
{
    (void)ctx, (void)error;
    struct state *s = state;
    static const struct adaptive_counts zero;
    gl.CreateBuffers(1, &s->counts);
    gl.NamedBufferData(s->counts, sizeof zero, &zero, GL_DYNAMIC_READ);
    return true;
}

static void destroy(struct technique_ctx *ctx, void *state)
{
    (void)ctx;
    gl.DeleteBuffers(1, &((struct state *)state)->counts);
}

static bool record(struct technique_run *run, struct pen_error *error)
{
    const struct adaptive *params = run->params;
    const struct state *state = run->state;
    struct pass_screen pass = {.name = "adaptive", .body = "adaptive_pcf.glsl"};
    pass_bind_counts(run->ctx, state->counts);
    if (params->estimator == ESTIMATOR_CSM) {
        struct convolution_desc desc = CONVOLUTION_DESC(params, true);
        desc.size = params->series_size;
        pass.body = "adaptive_csm.glsl";
        return convolution_screen(run, &desc, pass, 1.5f * params->min_filter + 1, error);
    }
    const struct shadow_input *map = pass_caster_map(run, params->map_size, error);
    const struct shadow_input *min_max =
        map ? pass_caster_min_max(run, params->map_size, error) : NULL;
    if (!min_max)
        return false;
    struct classify_desc classes = {.map_size = params->map_size,
        .margin_texels = 1.5f * params->min_filter + 1,
        .umbra = true,
        .bound = BOUND_PLANE};
    if (!pass_classify(run, &classes, &pass.tiles, error))
        return false;
    struct pass_texture pyramid = {UNIT_MIN_MAX, min_max->textures[0].name, GL_SAMPLE_NEAREST};
    pass.shadow = &map->textures[0];
    pass.textures = &pyramid;
    pass.texture_count = 1;
    return params->smooth.on ? pass_interleaved_colour(run, &pass, error)
                             : pass_screen(run, &pass, error);
}

static void finish(struct technique_ctx *ctx, void *state, struct pen_result *result)
{
    (void)ctx;
    struct state *s = state;
    static const struct adaptive_counts zero;
    gl.MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    gl.GetNamedBufferSubData(
        s->counts, 0, sizeof result->subdivided_pixels, result->subdivided_pixels);
    gl.NamedBufferSubData(s->counts, 0, sizeof zero, &zero);
}

const struct technique technique_adaptive = {
    .info = {.name = "adaptive",
        .title = "Adaptive filter subdivision",
        .summary = "Soft shadows of textured lights: splits the filter window into up to 16 cells "
                   "where visibility and emission vary, each weighted with its part of the light.",
        .citation = "Y. Chun, K. Oh, An efficient soft shadow mapping for area lights in various "
                    "shapes and colors, IEICE Trans. Inf. & Syst., 2016, "
                    "doi:10.1587/transinf.2016EDL8102",
        .artefacts = "One average blocker depth for all cells; patterns finer than a sixteenth of "
                     "the light are averaged." BLENDED_GRAIN,
        .cost_class = PEN_COST_MEDIUM,
        .textured = true,
        .struct_size = sizeof(struct adaptive),
        .params = {rows, sizeof rows / sizeof *rows}},
    .state_size = sizeof(struct state),
    .create = create,
    .sketch = "map_size=512 pcf_search_taps=4 pcf_taps=8",
    .record = record,
    .finish = finish,
    .destroy = destroy,
};
