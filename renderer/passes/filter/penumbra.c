#include "renderer/passes/filter/penumbra.h"
#include "renderer/passes/map/classify.h"
#include <stdio.h>

bool pass_penumbra_tiles(struct technique_run *run, const struct shadow_input *casters,
    float margin_texels, const struct gl_texture *scratch, const struct gl_texture **tiles,
    struct pen_error *error)
{
    struct gl_program_desc desc = {.vertex = "tiles.vert",
        .fragment = "constant.frag",
        .defines = "#define CONSTANT vec4(0.0, 0.0, 0.0, 0.001)\n"};
    *tiles = NULL;
    if (!run->request->classify.on)
        return true;
    GLuint program = gl_programs_get(run->ctx->programs, &desc, error);
    if (!program || !(*tiles = pass_classify_screen(run, casters, margin_texels, error)))
        return false;
    GLuint framebuffer = gl_framebuffer_create(&scratch, 1, NULL);
    pass_draw_tiles(
        run->ctx, program, framebuffer, *tiles, TILE_UMBRA, run->width, run->height, false);
    gl.DeleteFramebuffers(1, &framebuffer);
    return true;
}

bool pass_penumbra_spread(
    struct technique_run *run, uint32_t map_size, float min_filter, struct pen_error *error)
{
    static const float lit[4] = {1}; /* nothing to filter */
    const struct shadow_input *map = pass_caster_map(run, map_size, error);
    const struct shadow_input *min_max = map ? pass_caster_min_max(run, map_size, error) : NULL;
    if (!min_max)
        return false;
    const struct gl_texture *spread = pass_scratch(run, SCRATCH_SPREAD, GL_RGBA16F, 1);
    if (pass_is_first_face(run))
        pass_scratch_clear(spread, lit);
    const struct gl_texture *tiles;
    if (!pass_penumbra_tiles(run, min_max, min_filter + 1, spread, &tiles, error))
        return false;
    GLuint framebuffer = gl_framebuffer_create(&spread, 1, NULL);
    struct pass_texture pyramid = {UNIT_MIN_MAX, min_max->textures[0].name, GL_SAMPLE_NEAREST};
    bool ok = pass_screen(run,
        &(struct pass_screen){.name = "penumbra size",
            .body = "penumbra_estimate.glsl",
            .shadow = &map->textures[0],
            .textures = &pyramid,
            .texture_count = 1,
            .tiles = tiles,
            .framebuffer = framebuffer},
        error);
    gl.DeleteFramebuffers(1, &framebuffer);
    return ok;
}

/* One filter pass from a pair of scratch textures to the next pair, or to vis. */
struct step {
    const char *name, *fragment, *defines;
    enum penumbra_source source; /* of what this step reads */
    bool from_next, last;        /* reads the *_NEXT pair; writes vis */
    const void *extra;
    uint32_t extra_bytes;
};

static bool is_textured(const struct technique_run *run)
{
    return run->face->textured && run->technique->info.textured;
}

void pass_penumbra_start(struct technique_run *run, bool next)
{
    bool textured = is_textured(run);
    const float *mean = run->face->emission_mean;
    const float lit[4] = {
        textured ? mean[0] : 1, textured ? mean[1] : 1, textured ? mean[2] : 1, 1};
    int slot = next ? SCRATCH_LIT_NEXT : SCRATCH_LIT;
    for (int i = 0; i < (textured ? 2 : 1); i++)
        pass_scratch_clear(pass_scratch(run, slot + i, textured ? GL_RGBA16F : GL_RG16F, 1), lit);
}

static GLuint make_target(struct technique_run *run, bool next)
{
    struct gl_texture *first = &run->ctx->scratch[next ? SCRATCH_LIT_NEXT : SCRATCH_LIT];
    const struct gl_texture *targets[2] = {first, first + 1};
    return gl_framebuffer_create(targets, is_textured(run) ? 2 : 1, NULL);
}

static bool filter(struct technique_run *run, const struct step *step, struct pen_error *error)
{
    struct technique_ctx *ctx = run->ctx;
    char defines[256];
    bool hard = step->source == PENUMBRA_HARD;
    snprintf(defines, sizeof defines, "#define LIGHT_SHAPE %d\n#define LIGHT_PARALLEL %d\n%s%s%s%s",
        run->face->shape, run->face->parallel, step->defines, step->last ? "#define LAST\n" : "",
        hard ? "#define FROM_HARD\n" : "", is_textured(run) ? "#define TEXTURED\n" : "");
    GLuint framebuffer = 0;
    if (!step->last) {
        pass_penumbra_start(run, !step->from_next);
        framebuffer = make_target(run, !step->from_next);
    }
    int base = step->from_next ? SCRATCH_LIT_NEXT : SCRATCH_LIT;
    struct pass_texture textures[] = {{UNIT_DEPTH, run->gbuffer->depth.name, GL_SAMPLE_NEAREST},
        {UNIT_NORMAL, run->gbuffer->normal.name, GL_SAMPLE_NEAREST},
        {UNIT_FREE, ctx->scratch[SCRATCH_SPREAD].name, GL_SAMPLE_NEAREST},
        {UNIT_FREE + 1, ctx->scratch[base].name, GL_SAMPLE_NEAREST},
        {UNIT_FREE + 2, ctx->scratch[base + 1].name, GL_SAMPLE_NEAREST}};
    bool ok = pass_fill(ctx,
        &(struct pass_fill){.name = step->name,
            .fragment = step->fragment,
            .defines = defines,
            .stage = PEN_STAGE_TECHNIQUE,
            .textures = textures,
            .texture_count = hard               ? 3
                             : is_textured(run) ? 5
                                                : 4,
            .framebuffer = step->last ? run->vis_framebuffer : framebuffer,
            .width = run->width,
            .height = run->height,
            .extra = step->extra,
            .extra_bytes = step->extra_bytes,
            .info = &run->technique->info,
            .params = run->params},
        error);
    gl.DeleteFramebuffers(1, &framebuffer);
    return ok;
}

bool pass_penumbra_gauss(
    struct technique_run *run, enum penumbra_source source, struct pen_error *error)
{
    if (!pass_is_last_face(run))
        return true;
    struct step first = {
        .name = "filter x", .fragment = "penumbra_filter.frag", .defines = "", .source = source};
    struct step second = {.name = "filter y",
        .fragment = "penumbra_filter.frag",
        .defines = "#define SECOND\n",
        .source = PENUMBRA_SAMPLES,
        .from_next = true,
        .last = true};
    return filter(run, &first, error) && filter(run, &second, error);
}

bool pass_penumbra_atrous(struct technique_run *run, uint32_t levels, struct pen_error *error)
{
    if (!pass_is_last_face(run))
        return true;
    uint32_t passes = levels ? levels : 1;
    for (uint32_t i = 0; i < passes; i++) {
        int32_t block[4] = {1 << i, levels ? 2 : -1};
        struct step step = {.name = "a-trous",
            .fragment = "atrous.frag",
            .defines = "",
            .source = PENUMBRA_SAMPLES,
            .from_next = i & 1,
            .last = i + 1 == passes,
            .extra = block,
            .extra_bytes = sizeof block};
        if (!filter(run, &step, error))
            return false;
    }
    return true;
}
