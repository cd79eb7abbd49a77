#include "renderer/passes/draw/open_tiles.h"
#include "renderer/passes/draw/passes.h"
#include "renderer/passes/draw/screen.h"
#include "renderer/passes/draw/tiles.h"

#define SHARED_ROWS "renderer/shaders/screen/open_tiles.def"
#include "renderer/shared/rows_c.h"

bool pass_open_tiles(
    struct technique_run *run, const struct gl_texture **tiles, struct pen_error *error)
{
    static const struct pass_targets key = {1};
    struct gl_target *target = pass_targets(run->ctx, &key);
    uint32_t width = (run->width + OPEN_TILE - 1) / OPEN_TILE;
    uint32_t height = (run->height + OPEN_TILE - 1) / OPEN_TILE;
    gl_target_fit(target, GL_RG8, width, height, 0, 1);
    struct open_tiles_block block = {.tile = {OPEN_TILE, (int32_t)run->light_index}};
    struct pass_texture answers = {UNIT_SOURCE, run->vis->name, GL_SAMPLE_NEAREST};
    *tiles = &target->texture;
    return pass_fill(run->ctx,
        &(struct pass_fill){.name = "open tiles",
            .fragment = "open_tiles.frag",
            .stage = PEN_STAGE_TECHNIQUE,
            .textures = &answers,
            .texture_count = 1,
            .framebuffer = target->framebuffer,
            .width = width,
            .height = height,
            .extra = &block,
            .extra_bytes = sizeof block},
        error);
}
