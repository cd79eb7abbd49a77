#include "renderer/passes/draw/screen.h"
#include "renderer/passes/light/light_bits.h"
#include "renderer/techniques/patch_params.h"

static const char *const mode_names[] = {"paper", "clipped", NULL};
static const char *const window_names[] = {"light", "casters", NULL};

struct accumulation {
    uint32_t map_size;
    float bias;
    uint32_t mode, kernel, layers;
    float min_filter;
    uint32_t window;
};

static const struct pen_param rows[] = {
    MAP_SIZE_ROW(struct accumulation, 1024),
    BIAS_ROW(struct accumulation),
    PARAM(struct accumulation, mode, .def = 1, .choices = mode_names, .specialise = 1,
        .help = "As published, with kernel x kernel points, or with the texels' rectangles clipped "
                "against the light."),
    PARAM(struct accumulation, kernel, .def = 8, .min = 4, .max = 64, .unit = "texel",
        .help = "Mode paper: points across the window. Mode clipped: map texels across the light's "
                "image on each caster's depth; the finest mip level that is walked has at least as "
                "many."),
    LAYERS_ROW(struct accumulation),
    MIN_FILTER_ROW(struct accumulation),
    PARAM(struct accumulation, window, .choices = window_names, .specialise = 1,
        .help =
            "What the points of mode paper cover: the light as the receiver sees it, or the part "
            "that the nearest caster can hide."),
};

struct accumulation_state {
    struct light_bits bits[2]; /* by enum light_shape */
};

static bool record(struct technique_run *run, struct pen_error *error)
{
    const struct accumulation *params = run->params;
    struct accumulation_state *state = run->state;
    const struct shadow_input *layers =
        pass_caster_layers(run, params->map_size, params->layers, error);
    if (!layers)
        return false;
    const struct gl_texture *tiles;
    if (!patch_tiles(run, params->map_size, params->min_filter, params->mode != 0, &tiles, error))
        return false;
    struct light_bits *bits = &state->bits[run->face->shape];
    if (params->layers > 1)
        light_bits_fit(bits, 256, (uint32_t)run->face->shape, false);
    struct pass_texture textures[] = {{UNIT_CASTERS, layers->textures[0].name, GL_SAMPLE_NEAREST},
        {UNIT_MIN_MAX, layers->textures[1].name, GL_SAMPLE_NEAREST},
        {UNIT_LIGHT_BITS, bits->below.name, GL_SAMPLE_NEAREST}};
    return pass_screen(run,
        &(struct pass_screen){.name = "accumulation",
            .body = "accumulation.glsl",
            .defines = params->layers > 1 ? "#define LAYERED\n" : NULL,
            .textures = textures,
            .texture_count = params->layers > 1 ? 3 : 2,
            .tiles = tiles},
        error);
}

static void destroy(struct technique_ctx *ctx, void *state)
{
    (void)ctx;
    for (int i = 0; i < 2; i++)
        light_bits_finish(&((struct accumulation_state *)state)->bits[i]);
}

const struct technique technique_accumulation = {
    .info = {.name = "accumulation",
        .title = "Shadow accumulation",
        .summary = "Takes every texel of the shadow map for a small caster and adds up what each "
                   "hides of the light.",
        .citation = "B. Aszodi, L. Szirmay-Kalos, Real-time soft shadows with shadow accumulation, "
                    "Eurographics 2006 short papers",
        .artefacts =
            "Light leaks between texels at different depths among leaves, hair and flutes; "
            "what a surface without gaps closes off is dark; casters behind one another "
            "are not seen with one layer; mode paper over- and undershoots where texels "
            "are large against the light." BLENDED_GRAIN,
        .cost_class = PEN_COST_HEAVY,
        .textured = false,
        .struct_size = sizeof(struct accumulation),
        .params = {rows, sizeof rows / sizeof *rows}},
    .state_size = sizeof(struct accumulation_state),
    .sketch = "map_size=256 kernel=4",
    .record = record,
    .destroy = destroy,
};
