/* Rows of the methods that take the map's texels for casters (caster_patches.glsl). */
#pragma once
#include "renderer/passes/map/classify.h"
#include "renderer/passes/map/peel.h"
#include "renderer/techniques/map_params.h"

#define KERNEL_ROW(aggregate)                                                                      \
    PARAM(aggregate, kernel, .def = 8, .min = 4, .max = 64, .unit = "texel",                       \
        .help =                                                                                    \
            "Map texels across the light's image on each caster's depth: the finest mip level "    \
            "that is walked has at least as many.")
#define LAYERS_ROW(aggregate)                                                                      \
    PARAM(aggregate, layers, .def = 1, .min = 1, .max = PEEL_MAX_LAYERS,                           \
        .help = "Depth layers of casters, by depth peeling.")
#define MIN_FILTER_ROW(aggregate)                                                                  \
    PARAM(aggregate, min_filter, .def = 1, .min = 0.5, .max = 16, .unit = "texel",                 \
        .help = "Least half width of an edge.")
#define FILL_ROW(aggregate)                                                                        \
    PARAM(aggregate, fill, .def = 1, .choices = patch_fill_names, .specialise = 1,                 \
        .help =                                                                                    \
            "What neighbouring casters of about one depth do about gaps between them: nothing, "   \
            "stretch over a gap, or share one border (which also undoes overlaps).")
#define GAP_ROW(aggregate)                                                                         \
    PARAM(aggregate, gap, .def = 0.01, .min = 0, .max = 1,                                         \
        .help = "Depth step up to which neighbours are one surface, as a fraction of the depth.")

static const char *const patch_fill_names[] = {"none", "extend", "join", NULL};

/* *tiles: where the answer is open, for pass_screen; NULL when the request wants every pixel. */
static inline bool patch_tiles(struct technique_run *run, uint32_t map_size, float min_filter,
    bool umbra, const struct gl_texture **tiles, struct pen_error *error)
{
    return pass_classify(run,
        &(struct classify_desc){.map_size = map_size,
            .margin_texels = min_filter + 1,
            .umbra = umbra,
            .bound = BOUND_SURFACE},
        tiles, error);
}
