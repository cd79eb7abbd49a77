#include "renderer/passes/map/classify.h"
#include "protocol/memory.h"
#include "renderer/passes/draw/passes.h"
#include "renderer/passes/draw/screen.h"
#include "renderer/passes/map/min_max.h"
#include <stdlib.h>

#define SHARED_ROWS "renderer/shaders/screen/classify.def"
#include "renderer/shared/rows_c.h"

_Static_assert(TILE_EMPTY == sizeof(((struct pen_result *)0)->class_pixels) / sizeof(uint32_t),
    "a count for each");

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
    return pass_draw_tiles(
        run->ctx, program, framebuffer, tiles, TILE_UMBRA, run->width, run->height, false, error);
}

bool pass_classify(struct technique_run *run, const struct classify_desc *desc,
    const struct gl_texture **tiles, struct pen_error *error)
{
    static const struct pass_targets key = {1};
    *tiles = NULL;
    run->map_size = run->bound.map_size = desc->map_size;
    run->bound.texels = desc->margin_texels, run->bound.pixels = desc->margin_pixels;
    run->bound.window = desc->bound;
    run->bound.late = desc->seams;
    if (!run->request->classify.on)
        return true;
    const struct shadow_input *casters = pass_caster_min_max(run, desc->map_size, error);
    if (!casters)
        return false;
    struct gl_target *target = pass_targets(run->ctx, &key);
    uint32_t width = (run->width + CLASSIFY_TILE - 1) / CLASSIFY_TILE;
    uint32_t height = (run->height + CLASSIFY_TILE - 1) / CLASSIFY_TILE;
    gl_target_fit(target, GL_RG8, width, height, 0, 1);
    /* Spheres' far sides and textured lights need no zero tiles of their own: 0 is 0 in any colour;
     * but an omnidirectional light lights what lies behind its plane. */
    struct classify_block block = {.margin = {desc->margin_texels + 1, desc->margin_pixels},
        .tile = {CLASSIFY_TILE, desc->umbra && !run->face->omni, desc->one_window, desc->seams}};
    struct pass_texture textures[] = {
        {UNIT_DEPTH, run->gbuffer->depth.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_NORMAL, run->gbuffer->normal.texture.name, GL_SAMPLE_NEAREST},
        {UNIT_MIN_MAX, casters->textures[0].name, GL_SAMPLE_NEAREST}};
    if (!pass_fill(run->ctx,
            &(struct pass_fill){.name = "classify",
                .fragment = "classify.frag",
                .stage = PEN_STAGE_TECHNIQUE,
                .textures = textures,
                .texture_count = 3,
                .framebuffer = target->framebuffer,
                .width = width,
                .height = height,
                .extra = &block,
                .extra_bytes = sizeof block},
            error) ||
        !pass_fill_umbra(run, &target->texture, run->vis_framebuffer, error))
        return false;
    count_classes(run, &target->texture);
    *tiles = run->tiles = &target->texture;
    return true;
}
