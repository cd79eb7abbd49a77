#include "renderer/passes/draw/screen.h"
#include "renderer/passes/map/depth_map.h"
#include "renderer/passes/map/min_max.h"
#include "renderer/passes/map/shadow_cache.h"
#include <stdio.h>

#define SHARED_ROWS "renderer/shaders/map/level.def"
#include "renderer/shared/rows_c.h"

bool pass_min_max_levels(struct technique_ctx *ctx, const struct gl_texture *depth, uint32_t size,
    const struct gl_texture *pyramid, struct pen_error *error)
{
    static const char *const defines[2][2] = {
        {NULL, "#define FROM_DEPTH\n"}, {"#define EVEN\n", "#define EVEN\n#define FROM_DEPTH\n"}};
    GLuint framebuffer;
    gl.CreateFramebuffers(1, &framebuffer);
    bool ok = true;
    for (uint32_t level = 0; ok && level < pyramid->levels; level++) {
        gl.NamedFramebufferTexture(framebuffer, GL_COLOR_ATTACHMENT0, pyramid->name, (GLint)level);
        struct pass_texture from = {
            UNIT_SOURCE, level ? pyramid->name : depth->name, GL_SAMPLE_NEAREST};
        struct level_block source = {.level = {level ? (int32_t)level - 1 : 0}};
        uint32_t width = pyramid->width >> level ? pyramid->width >> level : 1;
        uint32_t below = level ? pyramid->width >> (level - 1) : size; /* side of the source */
        bool even = below > 1 && below % 2 == 0;
        ok = pass_fill(ctx,
            &(struct pass_fill){.name = "min-max",
                .fragment = "min_max.frag",
                .defines = defines[even][level == 0],
                .stage = PEN_STAGE_SHADOW,
                .textures = &from,
                .texture_count = 1,
                .framebuffer = framebuffer,
                .width = width,
                .height = width,
                .extra = &source,
                .extra_bytes = sizeof source},
            error);
    }
    gl.DeleteFramebuffers(1, &framebuffer);
    return ok;
}

static bool build(struct technique_run *run, const struct shadow_key *key,
    struct shadow_input *input, struct pen_error *error)
{
    const struct shadow_input *map = key->extra[0] ? pass_caster_map(run, key->size, error)
                                                   : pass_depth_map(run, key->size, error);
    if (!map)
        return false;
    uint32_t side = key->size > 1 ? key->size / 2 : 1;
    input->textures[0] = gl_texture_create(GL_RG32F, side, side, 0, 0);
    return pass_min_max_levels(run->ctx, &map->textures[0], key->size, &input->textures[0], error);
}

const struct shadow_input *pass_min_max(
    struct technique_run *run, uint32_t size, struct pen_error *error)
{
    struct shadow_key key = {.kind = "min-max", .size = size, .of_centre = true};
    return shadow_cache_get(run, &key, build, error);
}

const struct shadow_input *pass_caster_min_max(
    struct technique_run *run, uint32_t size, struct pen_error *error)
{
    struct shadow_key key = {.kind = "min-max", .size = size, .of_centre = true, .extra = {1}};
    run->map_size = size;
    return shadow_cache_get(run, &key, build, error);
}
