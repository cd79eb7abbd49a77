#include "renderer/passes/filter/changed.h"
#include "renderer/passes/draw/passes.h"
#include "renderer/passes/draw/screen.h"
#include "renderer/passes/draw/tiles.h"

bool pass_changed(struct technique_ctx *ctx, const struct gl_texture *vis, bool again,
    const struct gl_texture **tiles, struct pen_error *error)
{
    static const struct pass_targets key = {2};
    struct gl_target *now = pass_targets(ctx, &key), *before = now + 1, kept = *before;
    uint32_t width = (vis->width + CLASSIFY_TILE - 1) / CLASSIFY_TILE;
    uint32_t height = (vis->height + CLASSIFY_TILE - 1) / CLASSIFY_TILE;
    *before = *now, *now = kept;
    gl_target_fit(now, GL_RGBA32F, width, height, 0, 1);
    struct pass_texture textures[] = {{UNIT_SOURCE, vis->name, GL_SAMPLE_NEAREST},
        {UNIT_BEFORE, before->texture.name, GL_SAMPLE_NEAREST}};
    if (again)
        *tiles = &now->texture;
    return pass_fill(ctx,
        &(struct pass_fill){.name = "changed tiles",
            .fragment = "changed.frag",
            .defines = again ? "#define AGAIN\n" : NULL,
            .stage = PEN_STAGE_SHADE,
            .textures = textures,
            .texture_count = again ? 2 : 1,
            .framebuffer = now->framebuffer,
            .width = width,
            .height = height},
        error);
}
