#include "renderer/passes/map/classify.h"
#include "protocol/memory.h"
#include <stdlib.h>

struct classify_block {
    float margin[4];
    int32_t tile[4];
};

/* Adds up the receivers of each class. Reads 2 bytes per 64 pixels back. */
static void count_classes(struct technique_run *run, const struct gl_texture *tiles)
{
    uint32_t n = tiles->width * tiles->height;
    uint8_t(*found)[2] = pen_alloc(2 * n, 1); /* class, receivers */
    gl.PixelStorei(GL_PACK_ALIGNMENT, 1);
    gl.GetTextureImage(tiles->name, 0, GL_RG, GL_UNSIGNED_BYTE, (GLsizei)(2 * n), found);
    for (uint32_t i = 0; i < n; i++) {
        if (found[i][0] < TILE_EMPTY)
            run->result->class_pixels[found[i][0]] += found[i][1];
        if (found[i][0] == TILE_UNDECIDED)
            run->result->full_work_pixels += found[i][1];
    }
    free(found);
    run->work_counted = true;
}

bool pass_fill_umbra(struct technique_run *run, const struct gl_texture *tiles, GLuint framebuffer,
    struct pen_error *error)
{
    struct gl_program_desc desc = {.vertex = "tiles.vert",
        .fragment = "constant.frag",
        .defines = "#define CONSTANT vec4(0.0)\n"};
    GLuint program = gl_programs_get(run->ctx->programs, &desc, error);
    if (!program)
        return false;
    pass_draw_tiles(
        run->ctx, program, framebuffer, tiles, TILE_UMBRA, run->width, run->height, false);
    return true;
}

/* What a method needs to be true of a decided tile. */
struct claim {
    float margin_texels, margin_pixels;
    bool umbra;      /* looked for too */
    bool one_window; /* its windows do not shrink by caster, but with the nearest one only */
    bool seams;      /* it needs what lies beyond the faces of a cube */
};

static const struct gl_texture *classify(struct technique_run *run,
    const struct shadow_input *casters, const struct claim *claim, struct pen_error *error)
{
    struct technique_ctx *ctx = run->ctx;
    struct gl_texture *tiles = &ctx->tiles;
    uint32_t width = (run->width + CLASSIFY_TILE - 1) / CLASSIFY_TILE;
    uint32_t height = (run->height + CLASSIFY_TILE - 1) / CLASSIFY_TILE;
    if (gl_texture_fit(tiles, GL_RG8, width, height, 0, 1) || !ctx->tiles_framebuffer) {
        gl.DeleteFramebuffers(1, &ctx->tiles_framebuffer);
        const struct gl_texture *color = tiles;
        ctx->tiles_framebuffer = gl_framebuffer_create(&color, 1, NULL);
    }
    /* Spheres' far sides and textured lights need no zero tiles of their own: 0 is 0 in any colour;
     * but an omnidirectional light lights what lies behind its plane. */
    struct classify_block block = {.margin = {claim->margin_texels + 1, claim->margin_pixels},
        .tile = {CLASSIFY_TILE, claim->umbra && !run->face->omni, claim->one_window, claim->seams}};
    struct pass_texture textures[] = {{UNIT_DEPTH, run->gbuffer->depth.name, GL_SAMPLE_NEAREST},
        {UNIT_NORMAL, run->gbuffer->normal.name, GL_SAMPLE_NEAREST},
        {UNIT_MIN_MAX, casters->textures[0].name, GL_SAMPLE_NEAREST}};
    if (!pass_fill(ctx,
            &(struct pass_fill){.name = "classify",
                .fragment = "classify.frag",
                .stage = PEN_STAGE_TECHNIQUE,
                .textures = textures,
                .texture_count = 3,
                .framebuffer = ctx->tiles_framebuffer,
                .width = width,
                .height = height,
                .extra = &block,
                .extra_bytes = sizeof block},
            error) ||
        !pass_fill_umbra(run, tiles, run->vis_framebuffer, error))
        return NULL;
    count_classes(run, tiles);
    return run->tiles = tiles;
}

const struct gl_texture *pass_classify(struct technique_run *run,
    const struct shadow_input *casters, float margin_texels, struct pen_error *error)
{
    return classify(
        run, casters, &(struct claim){.margin_texels = margin_texels, .umbra = true}, error);
}

const struct gl_texture *pass_classify_screen(struct technique_run *run,
    const struct shadow_input *casters, float margin_texels, struct pen_error *error)
{
    return classify(run, casters, &(struct claim){margin_texels, 0, true, true, true}, error);
}

const struct gl_texture *pass_classify_lit(struct technique_run *run,
    const struct shadow_input *casters, float margin_texels, struct pen_error *error)
{
    return classify(run, casters, &(struct claim){.margin_texels = margin_texels}, error);
}

bool pass_lit_tiles(struct technique_run *run, uint32_t map_size, float margin_texels,
    float margin_pixels, const struct gl_texture **tiles, struct pen_error *error)
{
    *tiles = NULL;
    if (!run->request->classify.on)
        return true;
    const struct shadow_input *casters = pass_caster_min_max(run, map_size, error);
    if (casters)
        *tiles = classify(
            run, casters, &(struct claim){margin_texels, margin_pixels, false, true}, error);
    return *tiles != NULL;
}
