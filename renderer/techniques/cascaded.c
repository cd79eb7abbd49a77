#include "protocol/memory.h"
#include "renderer/passes/draw/pieces.h"
#include "renderer/passes/draw/screen.h"
#include "renderer/passes/draw/turn.h"
#include "renderer/passes/light/cascades.h"
#include "renderer/passes/map/classify.h"
#include "renderer/passes/light/sample_maps.h"
#include "renderer/passes/map/min_max.h"
#include "renderer/passes/map/shadow_cache.h"
#include "renderer/techniques/map_params.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TILE 16           /* px, of the tiles that cascades are fitted to */
#define MIN_MAX_SIZE 1024 /* texels of the map that is searched for blockers */

static const char *const split_names[] = {"practical", "paper", NULL};
static const char *const weight_names[] = {"uniform", "trapezoid", "cell-centred", NULL};
static const char *const filter_names[] = {"bridge", "texels", NULL};
enum { FILTER_BRIDGE, FILTER_TEXELS };

struct cascaded {
    uint32_t near_side, middle_side, far_side;
    uint32_t near_map_size, middle_map_size, far_map_size;
    uint32_t near_kernel, middle_kernel, far_kernel;
    uint32_t split;
    float lambda;
    uint32_t weights;
    uint32_t filter;
    float blend;
    float bias;
};

#define SIDE_ROW(field, default_side)                                                              \
    PARAM(struct cascaded, field, .def = default_side, .min = 1, .max = CASCADE_MAX_SIDE,          \
        .help = "Light samples along each side of the emitter, each with a map of its own.")
#define SIZE_ROW(field, default_size)                                                              \
    PARAM(struct cascaded, field, .def = default_size, .min = 16, .max = 4096, .unit = "texel",    \
        .help = "Side of each of the cascade's maps.")
#define KERNEL_ROW(field, default_kernel)                                                          \
    PARAM(struct cascaded, field, .def = default_kernel, .min = 1, .max = 8,                       \
        .help = "Depth comparisons along each side of the filter; 1: no filter.")

static const struct pen_param rows[] = {
    SIDE_ROW(near_side, 4),
    SIDE_ROW(middle_side, 3),
    SIDE_ROW(far_side, 2),
    SIZE_ROW(near_map_size, 1024),
    SIZE_ROW(middle_map_size, 512),
    SIZE_ROW(far_map_size, 128),
    KERNEL_ROW(near_kernel, 5),
    KERNEL_ROW(middle_kernel, 3),
    KERNEL_ROW(far_kernel, 2),
    PARAM(struct cascaded, split, .choices = split_names,
        .help = "Where cascades meet: between logarithmic and even steps, or as the paper prints."),
    PARAM(struct cascaded, lambda, .def = 0.5, .min = 0, .max = 1,
        .help = "Practical split: share of the logarithmic steps."),
    PARAM(struct cascaded, weights, .choices = weight_names, .def = CASCADE_WEIGHTS_CELL_CENTRED,
        .help = "Samples on a grid with the emitter's corners, equal or less at the borders, or in "
                "the centres of cells."),
    PARAM(struct cascaded, filter, .choices = filter_names, .specialise = 1,
        .help = "The filter reaches to the neighbouring sample's shadow, or over so many texels."),
    PARAM(struct cascaded, blend, .def = 0.1, .min = 0, .max = 0.5,
        .help = "Share of a cascade's depth over which it blends into the next."),
    BIAS_ROW(struct cascaded),
};

#define SHARED_ROWS "renderer/techniques/cascaded.def"
#include "renderer/shared/rows_c.h"
#define SHARED_ROWS "renderer/techniques/cascaded_tiles.def"
#include "renderer/shared/rows_c.h"

struct cascade {
    uint32_t number, side, map_size, kernel;
    struct cascade_bounds bounds;
    struct sample_view views[CASCADE_MAX_SIDE * CASCADE_MAX_SIDE];
    uint32_t view_count; /* those that see casters */
    struct cascade_block block;
};

struct state {
    struct gl_target tiles;
    float (*depth)[2];      /* tiles on the CPU */
    struct cascade cascade; /* the one at hand, too large for the stack */
};

static void destroy(struct technique_ctx *ctx, void *data)
{
    struct state *state = data;
    (void)ctx;
    gl_target_destroy(&state->tiles);
    free(state->depth);
}

/* Depth of the picture's tiles, read back: 8 bytes per 256 pixels. */
static bool read_tiles(
    struct technique_run *run, struct cascade_tiles *tiles, struct pen_error *error)
{
    struct state *state = run->state;
    *tiles = (struct cascade_tiles){.width = (run->width + TILE - 1) / TILE,
        .height = (run->height + TILE - 1) / TILE,
        .size = TILE};
    size_t bytes = (size_t)tiles->width * tiles->height * sizeof *state->depth;
    if (gl_target_fit(&state->tiles, GL_RG32F, tiles->width, tiles->height, 0, 1)) {
        free(state->depth);
        state->depth = pen_alloc(bytes, 1);
    }
    struct depth_tiles_block block = {.tile = {TILE}};
    struct pass_texture depth = {UNIT_DEPTH, run->gbuffer->depth.texture.name, GL_SAMPLE_NEAREST};
    if (!pass_fill(run->ctx,
            &(struct pass_fill){.name = "depth tiles",
                .fragment = "cascaded_tiles.frag",
                .stage = PEN_STAGE_TECHNIQUE,
                .textures = &depth,
                .texture_count = 1,
                .framebuffer = state->tiles.framebuffer,
                .width = tiles->width,
                .height = tiles->height,
                .extra = &block,
                .extra_bytes = sizeof block},
            error))
        return false;
    gl.PixelStorei(GL_PACK_ALIGNMENT, 4);
    gl.GetTextureImage(state->tiles.texture.name, 0, GL_RG, GL_FLOAT, (GLsizei)bytes, state->depth);
    tiles->depth = (const float(*)[2])state->depth;
    return true;
}

/* Samples, their windows and weights. */
static void make_views(struct technique_run *run, struct cascade *c)
{
    const struct cascaded *params = run->params;
    c->view_count = 0;
    c->block.count[0] = (int32_t)(c->side * c->side);
    c->block.count[1] = (int32_t)c->kernel;
    c->block.count[2] = (int32_t)c->side;
    for (uint32_t i = 0; i < c->side * c->side; i++) {
        float u, v, wu, wv, rect[4];
        cascade_sample_1d(params->weights, c->side, i % c->side, &u, &wu);
        cascade_sample_1d(params->weights, c->side, i / c->side, &v, &wv);
        struct sample_point point = sample_point_at(run->face, u, v);
        bool seen = cascade_window(run->face, run->light->casters, &c->bounds, point.at, c->side,
            c->kernel, c->map_size, rect);
        if (!seen)
            memcpy(rect, run->face->rect, sizeof rect);
        struct sample_map *entry = &c->block.samples[i];
        *entry = sample_map_entry(&point, rect, c->view_count);
        entry->layer[1] = wu * wv;
        entry->layer[2] = 2 / (float)c->side;
        if (!seen) {
            entry->layer[0] = -1;
            continue;
        }
        struct sample_view *view = &c->views[c->view_count];
        view->point = point;
        view->layer = c->view_count++;
        memcpy(view->rect, rect, sizeof rect);
    }
}

/* What build_maps draws: the builder only gets the run, and looks before it can give way. */
static const struct cascade *pending;

static bool build_maps(struct technique_run *run, const struct shadow_key *key,
    struct shadow_input *input, struct pen_error *error)
{
    const struct cascade *c = pending;
    if (!pass_room(run->ctx, (uint64_t)key->size * key->size * 4 * c->view_count, error))
        return false;
    input->textures[0] =
        gl_texture_create(GL_DEPTH_COMPONENT32F, key->size, key->size, c->view_count, 1);
    return pass_turn(run->ctx, error) &&
           pass_sample_views(run, c->views, c->view_count, &input->textures[0], error);
}

static const struct shadow_input *cascade_maps(
    struct technique_run *run, const struct cascade *c, struct pen_error *error)
{
    const struct cascaded *params = run->params;
    struct shadow_key key = {.kind = "cascade",
        .size = c->map_size,
        .extra = {c->side | params->weights << 8 | c->kernel << 16}};
    for (int k = 0; k < 3; k++) {
        key.extra[1 + 2 * k] = (uint32_t)c->bounds.low[k];
        key.extra[2 + 2 * k] = (uint32_t)c->bounds.high[k];
    }
    pending = c;
    return shadow_cache_get(run, &key, build_maps, error);
}

static bool add_cascade(struct technique_run *run, struct cascade *c,
    const struct gl_texture *tiles, const struct shadow_input *min_max, const struct gl_target *sum,
    struct pen_error *error)
{
    static const char *const names[CASCADES] = {"cascade near", "cascade middle", "cascade far"};
    make_views(run, c);
    if (!c->view_count)
        return true;
    const struct shadow_input *maps = cascade_maps(run, c, error);
    if (!maps)
        return false;
    run->result->shadow_maps += c->view_count;
    char defines[64];
    snprintf(defines, sizeof defines, "%s%s", sample_map_kernel(c->kernel),
        c->kernel * c->side * c->side >= 48 ? "#define MANY_LEVELS\n" : "");
    struct pass_texture textures[] = {
        {UNIT_SAMPLE_MAPS, maps->textures[0].name, GL_SAMPLE_NEAREST_BORDER},
        {UNIT_MIN_MAX, min_max->textures[0].name, GL_SAMPLE_NEAREST}};
    return pass_screen(run,
        &(struct pass_screen){.name = names[c->number],
            .body = "cascaded.glsl",
            .defines = defines,
            .textures = textures,
            .texture_count = 2,
            .framebuffer = sum->framebuffer,
            .add = true,
            .tiles = tiles,
            .extra = &c->block,
            .extra_bytes = sizeof c->block},
        error);
}

/* Where the cascade fades in and out, in m of view distance. */
static void make_fade(const float *bounds, uint32_t number, float blend, float fade[4])
{
    fade[0] = -2, fade[1] = -1; /* in from the start, never out */
    fade[2] = 1e30f, fade[3] = 2e30f;
    if (number > 0) {
        fade[1] = bounds[number];
        fade[0] = fade[1] - blend * (fade[1] - bounds[number - 1]);
    }
    if (number + 1 < CASCADES) {
        fade[3] = bounds[number + 1];
        fade[2] = fade[3] - blend * (fade[3] - bounds[number]);
    }
}

/* How far kernels reach, in texels of the map that tiles are classified by. */
static float kernel_reach(const uint32_t sizes[CASCADES], const uint32_t kernels[CASCADES])
{
    float most = 1;
    for (int i = 0; i < CASCADES; i++)
        most = fmaxf(most, (float)(MIN_MAX_SIZE * (kernels[i] + 2)) / (float)sizes[i]);
    return most;
}

static bool record(struct technique_run *run, struct pen_error *error)
{
    const struct cascaded *params = run->params;
    const struct light_face *face = run->face;
    const uint32_t sides[] = {params->near_side, params->middle_side, params->far_side};
    const uint32_t sizes[] = {params->near_map_size, params->middle_map_size, params->far_map_size};
    const uint32_t kernels[] = {params->near_kernel, params->middle_kernel, params->far_kernel};
    struct cascade_tiles depth_tiles;
    float range[2], bounds[CASCADES + 1];
    if (!read_tiles(run, &depth_tiles, error))
        return false;
    if (!cascade_range(run->view, run->light, &depth_tiles, range))
        return true; /* nothing casts on anything that is seen */
    cascade_splits(range[0], range[1], CASCADES, params->split, params->lambda, bounds);
    bounds[0] = range[0];
    const struct shadow_input *min_max = pass_caster_min_max(run, MIN_MAX_SIZE, error);
    if (!min_max)
        return false;
    struct classify_desc classes = {
        .map_size = MIN_MAX_SIZE, .margin_texels = kernel_reach(sizes, kernels)};
    const struct gl_texture *tiles;
    if (!pass_classify(run, &classes, &tiles, error))
        return false;
    run->map_size = 0;
    const struct gl_target *sum = pass_sum(run);
    for (uint32_t i = 0; i < CASCADES; i++) {
        struct cascade *c = &((struct state *)run->state)->cascade;
        bool point = !(face->extent[0] > 0 || face->extent[1] > 0);
        c->number = i;
        c->side = point ? 1 : sides[i];
        c->map_size = sizes[i];
        c->kernel = kernels[i];
        make_fade(bounds, i, params->blend, c->block.fade);
        if (!cascade_bounds(run->view, face, &depth_tiles, fmaxf(c->block.fade[0], range[0]),
                fminf(c->block.fade[3], range[1]), &c->bounds))
            continue;
        if (!add_cascade(run, c, tiles, min_max, sum, error))
            return false;
    }
    struct pass_texture summed = {UNIT_SOURCE, sum->texture.name, GL_SAMPLE_NEAREST};
    return pass_screen(run,
        &(struct pass_screen){.name = "cascaded resolve",
            .body = "cascaded_resolve.glsl",
            .textures = &summed,
            .texture_count = 1,
            .tiles = tiles},
        error);
}

const struct technique technique_cascaded = {
    .info = {.name = "cascaded",
        .title = "Cascaded soft shadow maps",
        .summary = "Splits the view distance into three cascades with 16, 9 and 4 light samples, "
                   "each with a shadow map fitted to the cascade, and bridges the samples with a "
                   "filter.",
        .citation = "Cascaded soft shadow maps, IIETA 2023; F. Zhang, H. Sun, L. Xu, L. Lun, "
                    "Parallel-split shadow maps for large-scale virtual environments, VRCIA 2006",
        .artefacts = "Far cascades have four samples and coarse maps: bands and blocky edges; maps "
                     "are drawn again when the camera moves." BLENDED_GRAIN,
        .cost_class = PEN_COST_HEAVY,
        .textured = true,
        .candidates = PEN_CANDIDATES(""),
        .struct_size = sizeof(struct cascaded),
        .params = {rows, sizeof rows / sizeof *rows}},
    .state_size = sizeof(struct state),
    .sketch = "near_side=2 middle_side=2 near_map_size=256 middle_map_size=256",
    .record = record,
    .destroy = destroy,
};
