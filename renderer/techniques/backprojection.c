#include "renderer/passes/draw/screen.h"
#include "renderer/passes/light/emission_sat.h"
#include "renderer/techniques/patch_params.h"

struct backprojection {
    uint32_t map_size;
    float bias;
    uint32_t kernel, layers, fill;
    float gap, min_filter;
};

static const struct pen_param rows[] = {
    MAP_SIZE_ROW(struct backprojection, 1024),
    BIAS_ROW(struct backprojection),
    KERNEL_ROW(struct backprojection),
    LAYERS_ROW(struct backprojection),
    FILL_ROW(struct backprojection),
    GAP_ROW(struct backprojection),
    MIN_FILTER_ROW(struct backprojection),
};

static bool record(struct technique_run *run, struct pen_error *error)
{
    const struct backprojection *params = run->params;
    const struct shadow_input *sums = NULL, *layers = pass_caster_layers(
                                                run, params->map_size, params->layers, error);
    if (!layers || (run->face->textured && !(sums = pass_emission_sat(run, error))))
        return false;
    const struct gl_texture *tiles;
    if (!patch_tiles(run, params->map_size, params->min_filter, true, &tiles, error))
        return false;
    struct pass_texture textures[] = {{UNIT_CASTERS, layers->textures[0].name, GL_SAMPLE_NEAREST},
        {UNIT_MIN_MAX, layers->textures[1].name, GL_SAMPLE_NEAREST},
        {UNIT_EMISSION_SUMS, sums ? sums->textures[0].name : 0, GL_SAMPLE_LINEAR}};
    return pass_screen(run,
        &(struct pass_screen){.name = "backprojection",
            .body = "backprojection.glsl",
            .defines = sums ? "#define TEXTURED\n" : NULL,
            .textures = textures,
            .texture_count = sums ? 3 : 2,
            .tiles = tiles},
        error);
}

const struct technique technique_backprojection = {
    .info = {.name = "backprojection",
        .title = "Soft shadow mapping by backprojection",
        .summary = "Projects every texel of the shadow map back to the light, clips it and takes "
                   "its area, or the emission inside, away.",
        .citation = "G. Guennebaud, L. Barthe, M. Paulin, Real-time soft shadow mapping by "
                    "backprojection, EGSR 2006",
        .artefacts =
            "Casters that overlap as seen from the receiver are subtracted twice, which is "
            "too dark; gaps wider than the threshold leak among leaves, hair and flutes, not "
            "through a surface without gaps; one layer sees only what the "
            "light's centre sees." BLENDED_GRAIN,
        .cost_class = PEN_COST_HEAVY,
        .textured = true,
        .candidates = PEN_CANDIDATES(""),
        .struct_size = sizeof(struct backprojection),
        .params = {rows, sizeof rows / sizeof *rows}},
    .sketch = "map_size=256",
    .record = record,
};
