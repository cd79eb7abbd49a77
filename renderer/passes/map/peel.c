#include "renderer/passes/map/peel.h"
#include "renderer/passes/draw/screen.h"
#include "renderer/passes/draw/turn.h"
#include "renderer/passes/map/depth_map.h"

#define SHARED_ROWS "renderer/shaders/map/level.def"
#include "renderer/shared/rows_c.h"

static void copy_layer(const struct gl_texture *from, const struct gl_texture *to, uint32_t layer)
{
    GLsizei side = (GLsizei)from->width;
    gl.CopyImageSubData(from->name, GL_TEXTURE_2D, 0, 0, 0, 0, to->name, GL_TEXTURE_2D_ARRAY, 0, 0,
        0, (GLint)layer, side, side, 1);
}

static bool draw_layers(struct technique_run *run, uint32_t size, const struct gl_texture *maps,
    struct pen_error *error)
{
    static const float center[2] = {0, 0};
    /* A layer is drawn beside the array: it reads the layer before, and one texture may not be
     * read and written at a time. */
    struct gl_target scratch[2] = {0};
    bool ok = true;
    gl_timer_begin(&run->ctx->timer, PEN_STAGE_SHADOW, "depth layers");
    for (uint32_t layer = 0; ok && layer < maps->layers; layer++) {
        struct gl_target *target = &scratch[layer & 1], *before = &scratch[~layer & 1];
        gl_target_fit(target, GL_DEPTH_COMPONENT32F, size, size, 0, 1);
        ok = layer ? pass_draw_casters_behind(
                         run, target->framebuffer, size, before->texture.name, error)
                   : pass_draw_casters(
                         run, target->framebuffer, size, center, run->face->rect, false, error);
        if (ok)
            copy_layer(&target->texture, maps, layer);
        ok = ok && pass_turn_inside(run->ctx, error);
    }
    gl_timer_end(&run->ctx->timer);
    gl_target_destroy(&scratch[0]);
    gl_target_destroy(&scratch[1]);
    return ok;
}

static bool build_pyramid(struct technique_run *run, const struct gl_texture *maps,
    const struct gl_texture *pyramid, struct pen_error *error)
{
    GLuint framebuffer;
    gl.CreateFramebuffers(1, &framebuffer);
    bool ok = true;
    for (uint32_t i = 0; ok && i < pyramid->layers * pyramid->levels; i++) {
        uint32_t layer = i / pyramid->levels, level = i % pyramid->levels;
        uint32_t side = pyramid->width >> level ? pyramid->width >> level : 1;
        gl.NamedFramebufferTextureLayer(
            framebuffer, GL_COLOR_ATTACHMENT0, pyramid->name, (GLint)level, (GLint)layer);
        struct pass_texture from = {
            UNIT_SOURCE, level ? pyramid->name : maps->name, GL_SAMPLE_NEAREST};
        struct level_block source = {.level = {level ? (int32_t)level - 1 : 0, (int32_t)layer}};
        ok = pass_fill(run->ctx,
            &(struct pass_fill){.name = "layer pyramid",
                .fragment = "layer_pyramid.frag",
                .defines = level ? NULL : "#define FROM_DEPTH\n",
                .stage = PEN_STAGE_SHADOW,
                .textures = &from,
                .texture_count = 1,
                .framebuffer = framebuffer,
                .width = side,
                .height = side,
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
    uint32_t layers = key->extra[0], size = key->size, side = 1;
    while (2 * side < size)
        side *= 2;
    input->textures[0] = gl_texture_create(GL_DEPTH_COMPONENT32F, size, size, layers, 1);
    input->textures[1] = gl_texture_create(GL_RGBA32F, side, side, layers, 0);
    return draw_layers(run, size, &input->textures[0], error) &&
           build_pyramid(run, &input->textures[0], &input->textures[1], error);
}

const struct shadow_input *pass_caster_layers(
    struct technique_run *run, uint32_t size, uint32_t layers, struct pen_error *error)
{
    struct shadow_key key = {.kind = "depth layers", .size = size, .extra = {layers}};
    return shadow_cache_get(run, &key, build, error);
}
