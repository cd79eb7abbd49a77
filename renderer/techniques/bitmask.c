#include "renderer/passes/filter/interleave.h"
#include "renderer/passes/light/light_bits.h"
#include "renderer/techniques/patch_params.h"

static const char *const sample_names[] = {"64", "256", NULL};
static const char *const pattern_names[] = {"regular", "jittered", NULL};

struct bitmask {
    uint32_t map_size;
    float bias;
    uint32_t kernel, samples, pattern, layers, fill;
    float gap, min_filter;
    pen_flag smooth;
};

static const struct pen_param rows[] = {
    MAP_SIZE_ROW(struct bitmask, 1024),
    BIAS_ROW(struct bitmask),
    KERNEL_ROW(struct bitmask),
    PARAM(struct bitmask, samples, .choices = sample_names, .specialise = 1,
        .help = "Points on the light, one bit each."),
    PARAM(struct bitmask, pattern, .def = 1, .choices = pattern_names, .specialise = 1,
        .help = "A square grid, or one of 16 sets with a point in each cell, row and column, "
                "changing from pixel to pixel."),
    LAYERS_ROW(struct bitmask),
    FILL_ROW(struct bitmask),
    GAP_ROW(struct bitmask),
    MIN_FILTER_ROW(struct bitmask),
    PARAM(struct bitmask, smooth, .def = 1, .specialise = 1,
        .help = "Averages the jittered sets over 4 x 4 pixels of wide penumbrae (not with an "
                "emission texture)."),
};

struct bitmask_state {
    struct light_bits bits[2]; /* by enum light_shape */
    struct gl_target emission; /* of the points */
};

static bool sample_emission(
    struct technique_run *run, const struct light_bits *bits, struct pen_error *error)
{
    struct bitmask_state *state = run->state;
    gl_target_fit(&state->emission, GL_RGBA32F, bits->at.width, bits->at.height, 0, 1);
    struct pass_texture textures[] = {{UNIT_SOURCE, bits->at.name, GL_SAMPLE_NEAREST},
        {UNIT_EMISSION, run->emission->name, GL_SAMPLE_TRILINEAR}};
    return pass_fill(run->ctx,
        &(struct pass_fill){.name = "emission of the points",
            .fragment = "bitmask_emission.frag",
            .stage = PEN_STAGE_TECHNIQUE,
            .textures = textures,
            .texture_count = 2,
            .framebuffer = state->emission.framebuffer,
            .width = bits->at.width,
            .height = bits->at.height},
        error);
}

static bool record(struct technique_run *run, struct pen_error *error)
{
    const struct bitmask *params = run->params;
    struct bitmask_state *state = run->state;
    bool jittered = params->pattern == 1, textured = run->face->textured;
    const struct shadow_input *layers =
        pass_caster_layers(run, params->map_size, params->layers, error);
    if (!layers)
        return false;
    const struct gl_texture *tiles;
    if (!patch_tiles(run, params->map_size, params->min_filter, true, &tiles, error))
        return false;
    struct light_bits *bits = &state->bits[run->face->shape];
    light_bits_fit(bits, params->samples ? 256 : 64, (uint32_t)run->face->shape, jittered);
    if (textured && !sample_emission(run, bits, error))
        return false;
    struct pass_texture textures[] = {{UNIT_CASTERS, layers->textures[0].name, GL_SAMPLE_NEAREST},
        {UNIT_MIN_MAX, layers->textures[1].name, GL_SAMPLE_NEAREST},
        {UNIT_LIGHT_BITS, bits->below.name, GL_SAMPLE_NEAREST},
        {UNIT_BIT_EMISSION, state->emission.texture.name, GL_SAMPLE_NEAREST}};
    struct pass_screen pass = {.name = "bitmask",
        .body = "bitmask.glsl",
        .defines = textured ? "#define TEXTURED\n" : NULL,
        .textures = textures,
        .texture_count = textured ? 4 : 3,
        .tiles = tiles};
    return params->smooth.on && jittered && !textured ? pass_interleaved(run, &pass, error)
                                                      : pass_screen(run, &pass, error);
}

static void destroy(struct technique_ctx *ctx, void *data)
{
    (void)ctx;
    struct bitmask_state *state = data;
    for (int i = 0; i < 2; i++)
        light_bits_finish(&state->bits[i]);
    gl_target_destroy(&state->emission);
}

const struct technique technique_bitmask = {
    .info = {.name = "bitmask",
        .title = "Bitmask soft shadows",
        .summary =
            "Projects every texel of the shadow map back to the light and marks which of 64 "
            "or 256 points it hides; overlapping casters are told from casters side by side.",
        .citation =
            "M. Schwarz, M. Stamminger, Bitmask soft shadows, Computer Graphics Forum 26(3) "
            "(Eurographics), 2007",
        .artefacts =
            "As many grey levels as points; gaps between texels of steep casters leak among "
            "leaves, hair and flutes, not through a surface without gaps; "
            "with one layer, only what the light's centre sees casts." BLENDED_GRAIN,
        .cost_class = PEN_COST_HEAVY,
        .textured = true,
        .struct_size = sizeof(struct bitmask),
        .params = {rows, sizeof rows / sizeof *rows}},
    .state_size = sizeof(struct bitmask_state),
    .sketch = "map_size=256",
    .record = record,
    .destroy = destroy,
};
