#include "renderer/passes/filter/penumbra.h"
#include "renderer/passes/draw/passes.h"
#include "renderer/passes/map/classify.h"
#include "renderer/passes/map/depth_map.h"
#include "renderer/passes/map/min_max.h"
#include <stdio.h>

#define SHARED_ROWS "renderer/shaders/filter/filter.def"
#include "renderer/shared/rows_c.h"
#define SHARED_ROWS "renderer/shaders/filter/atrous.def"
#include "renderer/shared/rows_c.h"

static struct gl_target *targets(struct technique_run *run)
{
    static const struct pass_targets key = {PENUMBRA_TARGETS};
    return pass_targets(run->ctx, &key);
}

const struct gl_target *pass_penumbra_target(struct technique_run *run, enum penumbra_target which)
{
    return &targets(run)[which];
}

bool pass_penumbra_tiles(struct technique_run *run, uint32_t map_size, float margin_texels,
    const struct gl_target *spread, const struct gl_texture **tiles, struct pen_error *error)
{
    struct gl_program_desc program_desc = {.vertex = "tiles.vert",
        .fragment = "constant.frag",
        .defines = "#define CONSTANT vec4(0.0, 0.0, 0.0, 0.001)\n"};
    struct classify_desc desc = {.map_size = map_size,
        .margin_texels = margin_texels,
        .umbra = true,
        .one_window = true,
        .seams = true,
        .bound = BOUND_LIGHT};
    if (!pass_classify(run, &desc, tiles, error))
        return false;
    if (!*tiles)
        return true;
    GLuint program = gl_programs_get(run->ctx->programs, &program_desc, error);
    return program && pass_draw_tiles(run->ctx, program, spread->framebuffer, *tiles, TILE_UMBRA,
                          run->width, run->height, false, error);
}

bool pass_penumbra_spread(
    struct technique_run *run, uint32_t map_size, float min_filter, struct pen_error *error)
{
    static const float lit[4] = {1}; /* nothing to filter */
    const struct shadow_input *map = pass_caster_map(run, map_size, error);
    const struct shadow_input *min_max = map ? pass_caster_min_max(run, map_size, error) : NULL;
    if (!min_max)
        return false;
    struct gl_target *spread = &targets(run)[PENUMBRA_SPREAD];
    gl_target_fit(spread, GL_RGBA16F, run->width, run->height, 0, 1);
    if (pass_is_first_face(run))
        gl_target_clear(spread, lit);
    const struct gl_texture *tiles;
    if (!pass_penumbra_tiles(run, map_size, min_filter + 1, spread, &tiles, error))
        return false;
    struct pass_texture pyramid = {UNIT_MIN_MAX, min_max->textures[0].name, GL_SAMPLE_NEAREST};
    return pass_screen(run,
        &(struct pass_screen){.name = "penumbra size",
            .body = "penumbra_estimate.glsl",
            .shadow = &map->textures[0],
            .textures = &pyramid,
            .texture_count = 1,
            .tiles = tiles,
            .framebuffer = spread->framebuffer},
        error);
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
    struct gl_target *pair = &targets(run)[next ? PENUMBRA_LIT_NEXT : PENUMBRA_LIT];
    for (int i = 0; i < (textured ? 2 : 1); i++) {
        gl_target_fit(&pair[i], textured ? GL_RGBA16F : GL_RG16F, run->width, run->height, 0, 1);
        gl_target_clear(&pair[i], lit);
    }
}

static GLuint make_target(struct technique_run *run, bool next)
{
    const struct gl_target *pair = &targets(run)[next ? PENUMBRA_LIT_NEXT : PENUMBRA_LIT];
    const struct gl_texture *textures[2] = {&pair[0].texture, &pair[1].texture};
    return gl_framebuffer_create(textures, is_textured(run) ? 2 : 1, NULL);
}

static bool filter(struct technique_run *run, const struct step *step, struct pen_error *error)
{
    const struct gl_target *all = targets(run);
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
    int base = step->from_next ? PENUMBRA_LIT_NEXT : PENUMBRA_LIT;
    struct pass_texture textures[] = {
        {UNIT_DEPTH, run->gbuffer->depth.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_NORMAL, run->gbuffer->normal.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_SPREAD, all[PENUMBRA_SPREAD].texture.name, GL_SAMPLE_NEAREST},
        {UNIT_RATIO_LIT, all[base].texture.name, GL_SAMPLE_NEAREST},
        {UNIT_RATIO_ALL, all[base + 1].texture.name, GL_SAMPLE_NEAREST}};
    bool ok = pass_fill(run->ctx,
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
        struct atrous_block block = {.step = {1 << i, levels ? 2 : -1}};
        struct step step = {.name = "a-trous",
            .fragment = "atrous.frag",
            .defines = "",
            .source = PENUMBRA_SAMPLES,
            .from_next = i & 1,
            .last = i + 1 == passes,
            .extra = &block,
            .extra_bytes = sizeof block};
        if (!filter(run, &step, error))
            return false;
    }
    return true;
}
