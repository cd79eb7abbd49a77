#include "renderer/passes/draw/open_tiles.h"
#include "renderer/passes/draw/screen.h"
#include "renderer/passes/draw/tiles.h"
#include "renderer/passes/map/depth_map.h"
#include "renderer/passes/map/shadow_cache.h"
#include "renderer/techniques/map_params.h"

struct hard {
    uint32_t map_size;
    float bias;
};

static const struct pen_param rows[] = {
    MAP_SIZE_ROW(struct hard, 2048),
    BIAS_ROW(struct hard),
};

static bool record(struct technique_run *run, struct pen_error *error)
{
    const struct hard *params = run->params;
    const struct shadow_input *map = pass_caster_map(run, params->map_size, error);
    if (!map)
        return false;
    const struct gl_texture *tiles;
    struct pass_screen pass = {.name = "hard", .body = "hard.glsl", .shadow = &map->textures[0]};
    struct pass_screen again = pass;
    if (!pass_screen(run, &pass, error) || !pass_open_tiles(run, &tiles, error))
        return false;
    again.name = "hard contacts";
    again.defines = "#define TOUCHED\n";
    again.tiles = tiles;
    again.tile_px = OPEN_TILE;
    return pass_screen(run, &again, error);
}

const struct technique technique_hard = {
    .info = {.name = "hard",
        .title = "Shadow map",
        .summary = "One depth comparison per pixel, seen from the centre of the light.",
        .citation = "L. Williams, Casting curved shadows on curved surfaces, SIGGRAPH 1978",
        .artefacts = "Hard, jagged edges whatever the size of the light." BLENDED_GRAIN,
        .cost_class = PEN_COST_CHEAP,
        .textured = false,
        .candidates = PEN_CANDIDATES(""),
        .struct_size = sizeof(struct hard),
        .params = {rows, sizeof rows / sizeof *rows}},
    .record = record,
};
