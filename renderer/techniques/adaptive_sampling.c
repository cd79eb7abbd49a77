#include "renderer/passes/draw/turn.h"
#include "renderer/passes/draw/screen.h"
#include "renderer/passes/map/classify.h"
#include "renderer/passes/light/light_tree.h"
#include "renderer/passes/light/sample_maps.h"
#include "renderer/passes/map/min_max.h"
#include "renderer/passes/map/shadow_cache.h"
#include "renderer/techniques/map_params.h"
#include <math.h>
#include <string.h>

#define MIN_MAX_SIZE 1024 /* texels of the map that is searched for blockers */
#define SHARED_ROWS "renderer/techniques/adaptive_bits.def"
#include "renderer/shared/rows_c.h"
#define SHARED_ROWS "renderer/techniques/adaptive_test.def"
#include "renderer/shared/rows_c.h"
#define SHARED_ROWS "renderer/techniques/adaptive_count.def"
#include "renderer/shared/rows_c.h"
#define SHARED_ROWS "renderer/techniques/adaptive_filter.def"
#include "renderer/shared/rows_c.h"
#define SHARED_ROWS "renderer/techniques/adaptive_resolve.def"
#include "renderer/shared/rows_c.h"

static const char *const count_names[] = {"atomic", "occlusion_query", NULL};
enum { COUNT_ATOMIC, COUNT_OCCLUSION_QUERY };

struct adaptive_sampling {
    uint32_t levels;
    uint32_t min_level;
    float threshold;
    uint32_t kernel;
    uint32_t map_size;
    uint32_t count;
    float bias;
};

static const struct pen_param rows[] = {
    PARAM(struct adaptive_sampling, levels, .def = 3, .min = 0, .max = LIGHT_TREE_LEVELS,
        .help = "How often the light is split at most: 4, 9, 25, 81 or 289 samples."),
    PARAM(struct adaptive_sampling, min_level, .def = 1, .min = 0, .max = LIGHT_TREE_LEVELS,
        .help = "How often it is split wherever something may cast, against thin casters."),
    PARAM(struct adaptive_sampling, threshold, .def = 0.05, .min = 0, .max = 100, .unit = "%",
        .help = "Share of the picture's pixels that must see a difference for a split."),
    PARAM(struct adaptive_sampling, kernel, .def = 2, .min = 1, .max = 5,
        .help = "Texels along each side of the filter, which bridges close samples; 1: none."),
    MAP_SIZE_ROW(struct adaptive_sampling, 512),
    PARAM(struct adaptive_sampling, count, .choices = count_names,
        .help = "What counts the pixels: atomic counters, or an occlusion query for each part of "
                "the light."),
    BIAS_ROW(struct adaptive_sampling),
};

/* Points that have been tested, by page. */
struct used_bits {
    uint32_t words[4 * LIGHT_PAGE_WORDS];
};
_Static_assert(LIGHT_PAGES <= 4 * LIGHT_PAGE_WORDS, "every page has a word");

/* One face's refinement. */
struct refinement {
    struct technique_run *run;
    const struct shadow_input *min_max;
    const struct gl_texture *tiles;
    struct light_tree tree;
    struct sample_point points[LIGHT_TREE_POINTS];
    struct used_bits used;
    const struct gl_texture *maps[LIGHT_PAGES];
    const struct gl_target *sum; /* of the filtered lookups; NULL without a filter */
    uint32_t pages, most_maps;
};

struct state {
    struct gl_target bits[BIT_GROUPS];
    GLuint counters, queries[MAX_TESTED];
    struct refinement refinement; /* too large for the stack */
};

static bool create(struct technique_ctx *ctx, void *data, struct pen_error *error)
{
    struct state *state = data;
    (void)ctx, (void)error;
    gl.CreateBuffers(1, &state->counters);
    gl.NamedBufferData(state->counters, 4 * MAX_TESTED, NULL, GL_DYNAMIC_READ);
    gl.CreateQueries(GL_SAMPLES_PASSED, MAX_TESTED, state->queries);
    return true;
}

static void destroy(struct technique_ctx *ctx, void *data)
{
    struct state *state = data;
    (void)ctx;
    for (int i = 0; i < BIT_GROUPS; i++)
        gl_target_destroy(&state->bits[i]);
    gl.DeleteBuffers(1, &state->counters);
    gl.DeleteQueries(MAX_TESTED, state->queries);
}

static const uint32_t group_first[BIT_GROUPS + 1] = {0, 2, 6, LIGHT_PAGES};

/* A page's bits, aimed at and, when it is `fresh`, cleared. Groups are made as they are needed. */
static const struct gl_target *page_bits(struct technique_run *run, uint32_t page, bool fresh)
{
    static const float zero[4] = {0};
    struct state *state = run->state;
    int group = page < 2 ? 0 : page < 6 ? 1 : 2;
    struct gl_target *bits = &state->bits[group];
    gl_target_fit(
        bits, GL_RG16, run->width, run->height, group_first[group + 1] - group_first[group], 1);
    gl_target_aim(bits, 0, page - group_first[group]);
    if (fresh)
        gl_target_clear(bits, zero);
    return bits;
}

static void bind_bits(const struct state *state, struct pass_texture textures[BIT_GROUPS])
{
    for (uint32_t i = 0; i < BIT_GROUPS; i++)
        textures[i] = (struct pass_texture){UNIT_BITS + i,
            state->bits[state->bits[i].texture.name ? i : 0].texture.name, GL_SAMPLE_NEAREST};
}

static struct sample_map entry_of(const struct refinement *r, uint32_t point, uint32_t layer)
{
    float rect[4];
    light_face_window(r->run->face, r->run->light->casters, r->points[point].at, rect);
    return sample_map_entry(&r->points[point], rect, layer);
}

/* Draws the maps that the page's points lack and adds what the pixels see of them. */
static bool test_page(
    struct refinement *r, uint32_t number, uint32_t wanted, bool first, struct pen_error *error)
{
    struct technique_run *run = r->run;
    const struct adaptive_sampling *params = run->params;
    const struct light_page *page = light_page(number);
    struct sample_point points[16];
    struct test_block block = {.count = {0, first},
        .reach = {(float)(params->kernel + 1) * MIN_MAX_SIZE / (float)params->map_size}};
    uint32_t fresh = wanted & ~r->used.words[number];
    if (!fresh)
        return true;
    const struct gl_target *bits = page_bits(run, number, !r->used.words[number]);
    for (uint32_t i = 0; i < page->count; i++) {
        points[i] = r->points[page->points[i]];
        if (fresh >> i & 1)
            block.samples[block.count[0]++] = entry_of(r, page->points[i], i);
    }
    r->maps[number] = pass_sample_page(run, points, page->count, params->map_size, wanted, error);
    if (!r->maps[number])
        return false;
    r->used.words[number] |= fresh;
    struct pass_texture textures[] = {
        {UNIT_SAMPLE_MAPS, r->maps[number]->name, GL_SAMPLE_NEAREST_BORDER},
        {UNIT_MIN_MAX, r->min_max->textures[0].name, GL_SAMPLE_NEAREST}};
    return pass_screen(run,
        &(struct pass_screen){.name = "light tests",
            .body = "adaptive_test.glsl",
            .defines = sample_map_kernel(params->kernel),
            .textures = textures,
            .texture_count = 2,
            .framebuffer = bits->framebuffer,
            .add = true,
            .tiles = r->tiles,
            .extra = &block,
            .extra_bytes = sizeof block},
        error);
}

/* Tests all points of the tree that have not been tested. */
static bool test_points(struct refinement *r, struct pen_error *error)
{
    bool first = !r->used.words[0];
    for (uint32_t number = 0; number < LIGHT_PAGES; number++) {
        const struct light_page *page = light_page(number);
        uint32_t wanted = 0;
        for (uint32_t i = 0; i < page->count; i++)
            wanted |= (uint32_t)r->tree.used[page->points[i]] << i;
        if (!test_page(r, number, wanted, first && number == 0, error))
            return false;
        if (wanted && number >= r->pages)
            r->pages = number + 1;
    }
    return true;
}

static bool count_pass(
    struct refinement *r, const struct count_block *block, bool query, struct pen_error *error)
{
    struct technique_run *run = r->run;
    struct pass_texture textures[BIT_GROUPS];
    bind_bits(run->state, textures);
    /* Nothing is written; any framebuffer of the picture's size will do. */
    return pass_fill(run->ctx,
        &(struct pass_fill){.name = "light counts",
            .fragment = "adaptive_count.frag",
            .defines = query ? "#define QUERY\n" : NULL,
            .stage = PEN_STAGE_TECHNIQUE,
            .textures = textures,
            .texture_count = BIT_GROUPS,
            .framebuffer = run->vis_framebuffer,
            .width = run->width,
            .height = run->height,
            .mute = true,
            .extra = block,
            .extra_bytes = sizeof *block},
        error);
}

/* One query cannot go on in another turn. */
static bool count_whole(
    struct refinement *r, const struct count_block *block, GLuint query, struct pen_error *error)
{
    struct technique_turns *turns = &r->run->ctx->turns;
    turns->held = true;
    gl.BeginQuery(GL_SAMPLES_PASSED, query);
    bool ok = count_pass(r, block, true, error);
    gl.EndQuery(GL_SAMPLES_PASSED);
    turns->held = false;
    return ok && pass_turn(r->run->ctx, error);
}

/* Pixels that see a difference within each of the block's quads. */
static bool count_quads(struct refinement *r, const struct count_block *block,
    uint32_t counts[MAX_TESTED], struct pen_error *error)
{
    const struct adaptive_sampling *params = r->run->params;
    const struct state *state = r->run->state;
    uint32_t n = (uint32_t)block->count[0];
    if (params->count == COUNT_ATOMIC) {
        static const uint32_t zero;
        gl.ClearNamedBufferData(state->counters, GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, &zero);
        pass_bind_counts(r->run->ctx, state->counters);
        if (!count_pass(r, block, false, error))
            return false;
        gl.MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
        gl.GetNamedBufferSubData(state->counters, 0, 4 * n, counts);
        return true;
    }
    for (uint32_t i = 0; i < n; i++) {
        struct count_block one = {.count = {1, block->count[1], block->count[2]}};
        memcpy(one.corners[0], block->corners[i], sizeof one.corners[0]);
        if (!count_whole(r, &one, state->queries[i], error))
            return false;
    }
    for (uint32_t i = 0; i < n; i++) { /* all are under way: one wait per level */
        GLuint64 passed;
        gl.GetQueryObjectui64v(state->queries[i], GL_QUERY_RESULT, &passed);
        counts[i] = (uint32_t)passed;
    }
    return true;
}

/* Splits the leaves of one level that matter to more than `threshold` pixels. Returns how many
 * could not be split for lack of memory; < 0: failed. */
static int split_level(struct refinement *r, uint32_t level, struct pen_error *error)
{
    const struct adaptive_sampling *params = r->run->params;
    struct count_block block = {.count = {0, (int32_t)r->pages, level < params->min_level}};
    uint32_t quads[MAX_TESTED], counts[MAX_TESTED];
    int refused = 0;
    for (uint32_t q = 0; q < r->tree.count; q++) {
        uint32_t corners[4];
        if (r->tree.quads[q].level != level)
            continue;
        light_tree_corners(&r->tree.quads[q], corners);
        for (int k = 0; k < 4; k++)
            block.corners[block.count[0]][k] = light_page_place(corners[k]);
        quads[block.count[0]++] = q;
    }
    if (!block.count[0])
        return 0;
    if (!count_quads(r, &block, counts, error))
        return -1;
    double least = 0.01 * (double)params->threshold * r->run->width * r->run->height;
    for (int i = 0; i < block.count[0]; i++) {
        if (!(counts[i] > least))
            continue;
        if (r->tree.used_count + 5 > r->most_maps)
            refused++;
        else
            light_tree_split(&r->tree, quads[i]);
    }
    return refused;
}

/* Samples with their weights, in the order of pages; returns how many. */
static uint32_t fill_samples(
    const struct refinement *r, uint32_t page_from, uint32_t page_to, struct sample_map *samples)
{
    float weights[LIGHT_TREE_POINTS];
    uint32_t n = 0;
    light_tree_weights(&r->tree, weights);
    for (uint32_t number = page_from; number < page_to; number++) {
        const struct light_page *page = light_page(number);
        for (uint32_t i = 0; i < page->count; i++) {
            uint32_t point = page->points[i];
            if (!(r->used.words[number] >> i & 1))
                continue;
            struct sample_map *entry = &samples[n++];
            *entry = entry_of(r, point, i);
            entry->layer[1] = weights[point];
            entry->layer[2] = 2 * sqrtf(weights[point]);
            entry->layer[3] = (float)(16 * number + i);
        }
    }
    return n;
}

/* Filtered lookups for the pixels whose samples differ, summed up. */
static bool filter_pages(struct refinement *r, struct pen_error *error)
{
    struct technique_run *run = r->run;
    const struct adaptive_sampling *params = run->params;
    r->sum = pass_sum(run);
    for (uint32_t number = 0; number < r->pages; number++) {
        struct filter_block block = {.count = {0}};
        struct pass_texture textures[BIT_GROUPS + 1];
        if (!r->used.words[number])
            continue;
        memcpy(block.used, r->used.words, sizeof block.used);
        block.count[0] = (int32_t)fill_samples(r, number, number + 1, block.samples);
        block.count[1] = (int32_t)r->pages;
        bind_bits(run->state, textures);
        textures[BIT_GROUPS] = (struct pass_texture){
            UNIT_SAMPLE_MAPS, r->maps[number]->name, GL_SAMPLE_NEAREST_BORDER};
        if (!pass_screen(run,
                &(struct pass_screen){.name = "light filter",
                    .body = "adaptive_filter.glsl",
                    .defines = sample_map_kernel(params->kernel),
                    .textures = textures,
                    .texture_count = BIT_GROUPS + 1,
                    .framebuffer = r->sum->framebuffer,
                    .add = true,
                    .tiles = r->tiles,
                    .extra = &block,
                    .extra_bytes = sizeof block},
                error))
            return false;
    }
    return true;
}

static bool resolve(struct refinement *r, struct pen_error *error)
{
    struct technique_run *run = r->run;
    const struct adaptive_sampling *params = run->params;
    struct resolve_block block = {.count = {0}};
    struct pass_texture textures[BIT_GROUPS + 1];
    memcpy(block.used, r->used.words, sizeof block.used);
    block.count[0] = (int32_t)fill_samples(r, 0, r->pages, block.samples);
    block.count[1] = (int32_t)r->pages;
    run->result->shadow_maps += (uint32_t)block.count[0];
    bind_bits(run->state, textures);
    textures[BIT_GROUPS] =
        (struct pass_texture){UNIT_FILTERED, r->sum ? r->sum->texture.name : 0, GL_SAMPLE_NEAREST};
    return pass_screen(run,
        &(struct pass_screen){.name = "light resolve",
            .body = "adaptive_resolve.glsl",
            .defines = sample_map_kernel(params->kernel),
            .textures = textures,
            .texture_count = BIT_GROUPS + 1,
            .tiles = r->tiles,
            .extra = &block,
            .extra_bytes = sizeof block},
        error);
}

/* How deep this picture's and these maps' memory allows to go. */
static uint32_t deepest_level(const struct technique_run *run)
{
    const struct adaptive_sampling *params = run->params;
    bool point = !(run->face->extent[0] > 0 || run->face->extent[1] > 0);
    uint32_t level = point ? 0 : params->levels;
    while (level > 0 &&
           (uint64_t)light_pages(level) * run->width * run->height * 4 > run->ctx->shadow_budget)
        level--;
    return level;
}

static bool record(struct technique_run *run, struct pen_error *error)
{
    struct refinement *r = &((struct state *)run->state)->refinement;
    const struct adaptive_sampling *params = run->params;
    uint64_t map_bytes = (uint64_t)params->map_size * params->map_size * 4;
    uint64_t most = run->ctx->shadow_budget / map_bytes;
    uint32_t deepest = deepest_level(run);
    bool point = !(run->face->extent[0] > 0 || run->face->extent[1] > 0);
    bool short_of = !point && deepest < params->levels;
    memset(r, 0, sizeof *r);
    r->run = run;
    r->most_maps = most < LIGHT_TREE_POINTS ? (uint32_t)most : 2 * LIGHT_TREE_POINTS; /* no limit */
    r->min_max = pass_caster_min_max(run, MIN_MAX_SIZE, error);
    if (!r->min_max)
        return false;
    struct classify_desc classes = {.map_size = MIN_MAX_SIZE,
        .margin_texels = (float)(params->kernel + 1) * MIN_MAX_SIZE / (float)params->map_size};
    if (!pass_classify(run, &classes, &r->tiles, error))
        return false;
    run->map_size = params->map_size;
    for (uint32_t i = 0; i < LIGHT_TREE_POINTS; i++)
        r->points[i] = sample_point_at(
            run->face, (float)(i % LIGHT_TREE_SIDE) / 8 - 1, (float)(i / LIGHT_TREE_SIDE) / 8 - 1);
    light_tree_begin(&r->tree);
    if (!test_points(r, error))
        return false;
    for (uint32_t level = 0; level < deepest; level++) {
        uint32_t before = r->tree.count;
        int refused = split_level(r, level, error);
        if (refused < 0)
            return false;
        short_of |= refused > 0;
        if (r->tree.count == before)
            break;
        if (!test_points(r, error))
            return false;
    }
    if (short_of && !run->result->warning_count)
        pen_result_warn(
            run->result, "The light is divided less finely than asked: its maps need more memory.");
    return (params->kernel == 1 || filter_pages(r, error)) && resolve(r, error);
}

const struct technique technique_adaptive_sampling = {
    .info = {.name = "adaptive-sampling",
        .title = "Adaptive light source subdivision",
        .summary = "Starts with the light's corners and splits those parts of it whose samples "
                   "disagree for visible pixels, up to 289 samples with a shadow map each.",
        .citation = "M. Schwaerzler, O. Mattausch, D. Scherzer, M. Wimmer, Fast accurate soft "
                    "shadows with adaptive light source sampling, VMV 2012",
        .artefacts =
            "A caster can hide between samples that agree; few samples show as bands; the "
            "sample set, and with it the penumbra, can change as the camera moves." BLENDED_GRAIN,
        .cost_class = PEN_COST_HEAVY,
        .textured = true,
        .struct_size = sizeof(struct adaptive_sampling),
        .params = {rows, sizeof rows / sizeof *rows}},
    .state_size = sizeof(struct state),
    .create = create,
    .sketch = "levels=0 min_level=0 map_size=256",
    .record = record,
    .destroy = destroy,
};
