/* Rows and glue that the methods on a blurred moment map share. */
#pragma once
#include "renderer/passes/draw/screen.h"
#include "renderer/passes/map/moments.h"
#include "renderer/techniques/map_params.h"

#define BLUR_ROW(aggregate)                                                                        \
    PARAM(aggregate, blur, .def = 2, .min = 0, .max = 15, .unit = "texel",                         \
        .help = "Radius of the Gaussian that the map is blurred with.")

/* Prepares the map and runs the pass, whose body includes moment_lookup.glsl, over the receivers. */
static inline bool moment_screen(struct technique_run *run, const struct moment_map *desc,
    bool bounded, const char *name, const char *body, struct pen_error *error)
{
    const struct shadow_input *map = pass_moments(run, desc, error);
    const struct gl_texture *tiles;
    if (!map || !pass_moment_tiles(run, desc, &tiles, error))
        return false;
    if (!bounded)
        run->bound.map_size = 0;
    struct pass_texture texture = {UNIT_SOURCE, map->textures[0].name, GL_SAMPLE_TRILINEAR};
    return pass_screen(run,
        &(struct pass_screen){
            .name = name, .body = body, .textures = &texture, .texture_count = 1, .tiles = tiles},
        error);
}
