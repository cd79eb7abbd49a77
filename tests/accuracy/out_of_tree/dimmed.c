/* A method that the tree does not know: hard shadows that let a share of the light through. Its
 * three pieces are this file, dimmed.glsl and one line at the end of a copy of registry.def. */
#include "renderer/passes/draw/screen.h"
#include "renderer/passes/map/depth_map.h"
#include "renderer/passes/map/shadow_cache.h"
#include "renderer/techniques/map_params.h"

struct dimmed {
    uint32_t map_size;
    float bias;
    float share;
};

static const struct pen_param rows[] = {
    MAP_SIZE_ROW(struct dimmed, 1024),
    BIAS_ROW(struct dimmed),
    PARAM(struct dimmed, share, .def = 0.25, .min = 0, .max = 1, .help = "Light in the umbra."),
};

static bool record(struct technique_run *run, struct pen_error *error)
{
    const struct dimmed *params = run->params;
    const struct shadow_input *map = pass_caster_map(run, params->map_size, error);
    struct pass_screen pass = {.name = "dimmed", .body = "dimmed.glsl"};
    if (!map)
        return false;
    pass.shadow = &map->textures[0];
    return pass_screen(run, &pass, error);
}

const struct technique technique_dimmed = {
    .info = {.name = "dimmed",
        .title = "Dimmed shadow map",
        .summary = "One depth comparison per pixel that lets a share of the light through.",
        .citation = "None: it only shows what a method is made of.",
        .artefacts = "Hard edges, and umbrae that are not dark.",
        .cost_class = PEN_COST_CHEAP,
        .textured = false,
        .struct_size = sizeof(struct dimmed),
        .params = {rows, sizeof rows / sizeof *rows}},
    .record = record,
};
