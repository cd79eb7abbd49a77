#include "renderer/passes/draw/screen.h"
#include "renderer/passes/map/classify.h"
#include "renderer/passes/map/depth_map.h"
#include "renderer/passes/map/shadow_cache.h"
#include "renderer/techniques/map_params.h"

struct pcf {
    uint32_t map_size;
    float bias;
    float radius;
    uint32_t taps;
};

static const struct pen_param rows[] = {
    MAP_SIZE_ROW(struct pcf, 1024),
    BIAS_ROW(struct pcf),
    PARAM(struct pcf, radius, .def = 1.5, .min = 0.5, .max = 64, .unit = "texel",
        .help = "Half width of the filter."),
    PARAM(struct pcf, taps, .def = 16, .min = 1, .max = 64, .help = "Depth comparisons per pixel."),
};

static bool record(struct technique_run *run, struct pen_error *error)
{
    const struct pcf *params = run->params;
    const struct shadow_input *map = pass_caster_map(run, params->map_size, error);
    if (!map)
        return false;
    struct classify_desc classes = {
        .map_size = params->map_size, .margin_texels = params->radius + 2, .umbra = true};
    const struct gl_texture *tiles;
    if (!pass_classify(run, &classes, &tiles, error))
        return false;
    return pass_screen(run,
        &(struct pass_screen){
            .name = "pcf", .body = "pcf.glsl", .shadow = &map->textures[0], .tiles = tiles},
        error);
}

const struct technique technique_pcf = {
    .info = {.name = "pcf",
        .title = "Percentage-closer filtering",
        .summary = "Averages depth comparisons over a fixed square of the shadow map.",
        .citation = "W. Reeves, D. Salesin, R. Cook, Rendering antialiased shadows with depth "
                    "maps, SIGGRAPH 1987",
        .artefacts = "The width of the edge is that of the filter, whatever the light and the "
                     "distances; few taps show as bands." BLENDED_GRAIN,
        .cost_class = PEN_COST_CHEAP,
        .textured = false,
        .candidates = PEN_CANDIDATES(""),
        .struct_size = sizeof(struct pcf),
        .params = {rows, sizeof rows / sizeof *rows}},
    .record = record,
};
