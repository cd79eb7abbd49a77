#include "renderer/passes/map/moments.h"
#include "renderer/techniques/map_params.h"

struct vsm {
    uint32_t map_size;
    float bias;
    uint32_t blur;
    float min_variance;
    float bleed;
};

static const struct pen_param rows[] = {
    MAP_SIZE_ROW(struct vsm, 1024),
    BIAS_ROW(struct vsm),
    PARAM(struct vsm, blur, .def = 2, .min = 0, .max = 15, .unit = "texel",
        .help = "Radius of the Gaussian that the map is blurred with."),
    PARAM(struct vsm, min_variance, .def = 1e-5, .min = 0, .max = 0.01,
        .help = "Least variance of depth, in squares of the map's depth range."),
    PARAM(struct vsm, bleed, .def = 0.2, .min = 0, .max = 0.9,
        .help = "Visibility that counts as none; cuts light bleeding and narrows edges."),
};

static bool record(struct technique_run *run, struct pen_error *error)
{
    const struct vsm *params = run->params;
    struct moment_map desc = {
        .kind = MOMENTS_VARIANCE, .size = params->map_size, .blur = params->blur};
    const struct shadow_input *map = pass_moments(run, &desc, error);
    const struct gl_texture *tiles;
    if (!map || !pass_moment_tiles(run, &desc, &tiles, error))
        return false;
    struct pass_texture texture = {UNIT_FREE, map->textures[0].name, GL_SAMPLE_TRILINEAR};
    return pass_screen(run,
        &(struct pass_screen){.name = "vsm",
            .body = "vsm.glsl",
            .textures = &texture,
            .texture_count = 1,
            .tiles = tiles},
        error);
}

const struct technique technique_vsm = {
    .info = {.name = "vsm",
        .title = "Variance shadow map",
        .summary = "Blurs depth and its square in the map and bounds the share of light with "
                   "Chebyshev's inequality.",
        .citation = "W. Donnelly, A. Lauritzen, Variance shadow maps, I3D 2006",
        .artefacts = "Light bleeds where a second caster lies behind the first; edges have the "
                     "width of the blur whatever the light.",
        .cost_class = PEN_COST_CHEAP,
        .textured = false,
        .struct_size = sizeof(struct vsm),
        .params = {rows, sizeof rows / sizeof *rows}},
    .record = record,
};
