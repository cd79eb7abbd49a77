/* Rows and glue that the methods on a summed-area table of moments share. */
#pragma once
#include "renderer/passes/draw/screen.h"
#include "renderer/passes/map/classify.h"
#include "renderer/passes/map/min_max.h"
#include "renderer/passes/map/sat.h"
#include "renderer/techniques/map_params.h"

#define SAT_ROWS(aggregate, widest)                                                                \
    PARAM(aggregate, min_filter, .def = 1, .min = 0.5, .max = 16, .unit = "texel",                 \
        .help = "Least half width of a window."),                                                  \
        PARAM(aggregate, max_window, .def = 128, .min = 40, .max = widest, .unit = "texel",        \
            .help =                                                                                \
                "Width of the widest window: the table is halved until the light's search fits.")

/* What a pass over the receivers reads: the table, the bounds of depth, and the tiles to draw. */
struct sat_lookup {
    struct pass_texture textures[2];
    const struct gl_texture *tiles;
    struct sat_block block;
};

static inline bool sat_prepare(struct technique_run *run, const struct sat_table *table,
    float min_filter, bool bounded, struct sat_lookup *lookup, struct pen_error *error)
{
    const struct shadow_input *min_max = pass_min_max(run, table->map_size, error);
    const struct shadow_input *sat = min_max ? pass_sat(run, table, &lookup->block, error) : NULL;
    struct classify_desc classes = {.map_size = table->map_size,
        .margin_texels = min_filter + 1,
        .one_window = true,
        .bound = BOUND_LIGHT};
    if (!sat || !pass_classify(run, &classes, &lookup->tiles, error))
        return false;
    if (!bounded)
        run->bound.map_size = 0;
    lookup->textures[0] = (struct pass_texture){UNIT_SAT, sat->textures[0].name, GL_SAMPLE_NEAREST};
    lookup->textures[1] =
        (struct pass_texture){UNIT_MIN_MAX, min_max->textures[0].name, GL_SAMPLE_NEAREST};
    return true;
}
