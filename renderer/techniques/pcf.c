#include "renderer/passes/map/classify.h"
#include "renderer/passes/draw/passes.h"
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
    const struct gl_texture *tiles = NULL;
    if (run->request->classify.on) {
        const struct shadow_input *min_max = pass_caster_min_max(run, params->map_size, error);
        if (!min_max || !(tiles = pass_classify(run, min_max, params->radius + 2, error)))
            return false;
    }
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
                     "distances; few taps show as bands.",
        .cost_class = PEN_COST_CHEAP,
        .textured = false,
        .candidates = PEN_CANDIDATES(""),
        .struct_size = sizeof(struct pcf),
        .params = {rows, sizeof rows / sizeof *rows}},
    .record = record,
};
