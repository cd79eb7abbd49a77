/* Depths at several places in every pixel, of which shading knows one. */
#pragma once
#include "renderer/edges/cover.h"
#include "renderer/technique.h"

#define SHARED_ROWS "renderer/shaders/frame/edges.def"
#include "renderer/shared/rows_c.h"

/* Whose depths. */
enum places_kind { PLACES_ALL, PLACES_SOLID, PLACES_BLENDED }; /* solid: see GBUFFER_SOLID */

struct places_pass {
    enum places_kind kind;
    bool ground;
    uint32_t first, rows; /* of the picture */
};

/* What the view sees at EDGE_PLACES places of the pixels in some rows, into a target of so many
 * samples. `where`: the places. */
bool pass_places(struct technique_ctx *ctx, struct scene *scene, const struct view *view,
    const struct places_pass *which, struct gl_target *depths, struct edges_block *where,
    struct pen_error *error);
/* The same, drawn by the CPU, of what these tiles want. Software rasterisers take longer for each
 * triangle, and for all the pixels of which nobody asks. */
bool pass_cover(struct technique_ctx *ctx, struct scene *scene, const struct view *view,
    const struct places_pass *which, struct cover_tile *tiles, cover_places *depths, float *least,
    struct pen_error *error);
