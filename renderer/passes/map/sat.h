/* Summed-area tables of depth moments in modular integers: each moment is rounded to a multiple of
 * 1 / scale and summed modulo 2^32. A window's sum is the difference of four corners, in which
 * wrap-around cancels as long as the window itself fits, so that a mean keeps its digits wherever
 * in the table the window lies (floating-point tables lose them towards the far corner). */
#pragma once
#include "renderer/passes/map/shadow_cache.h"

/* How the sums are made; all give the same bits. */
enum sat_path {
    SAT_AUTO,    /* by device: measured, the host is faster where there is no GPU */
    SAT_HOST,    /* read back, one sequential scan, upload */
    SAT_COMPUTE, /* two dispatches: scan rows and transpose, twice */
};

/* Sums of `from` (side x side, GL_RG32UI or GL_RGBA32UI) into `to` (side + 1 squared, same format):
 * texel (x, y) of `to` is the sum over [0, x) x [0, y), modulo 2^32. */
bool sat_scan(struct technique_ctx *ctx, const struct gl_texture *from, const struct gl_texture *to,
    enum sat_path path, struct pen_error *error);

enum sat_kind {
    SAT_VARIANCE,     /* RG32UI: unit depth and its square */
    SAT_FOUR_MOMENTS, /* RGBA32UI: packed moments, see moments.glsl */
};

struct sat_table {
    uint32_t kind;       /* enum sat_kind */
    uint32_t map_size;   /* of the depth map, texels per side */
    uint32_t max_window; /* texels: the table is halved until the light's widest search fits */
    enum sat_path path;
};

/* struct sat_block */
#define SHARED_ROWS "renderer/shaders/lookup/sat.def"
#include "renderer/shared/rows_c.h"

/* The table in textures[0]. Kept between requests. Fills *block. */
const struct shadow_input *pass_sat(struct technique_run *run, const struct sat_table *table,
    struct sat_block *block, struct pen_error *error);
