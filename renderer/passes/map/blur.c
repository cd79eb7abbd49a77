#include "renderer/passes/map/blur.h"
#include "renderer/passes/draw/screen.h"
#include "renderer/passes/draw/turn.h"
#include <math.h>
#include <string.h>

void blur_weights(uint32_t radius, float weights[BLUR_MAX_RADIUS + 1])
{
    double raw[BLUR_MAX_RADIUS + 1], sum = 0, sigma = 0.5 * (radius + 0.5);
    for (uint32_t i = 0; i <= radius; i++) {
        raw[i] = exp(-0.5 * i * i / (sigma * sigma));
        sum += i ? 2 * raw[i] : raw[i];
    }
    for (uint32_t i = 0; i <= BLUR_MAX_RADIUS; i++)
        weights[i] = i <= radius ? (float)(raw[i] / sum) : 0;
}

static bool run(struct technique_ctx *ctx, const struct gl_texture *from, GLuint framebuffer,
    uint32_t radius, int axis, struct pen_error *error)
{
    struct blur_block block = {0};
    block.step[axis] = 1 / (float)(axis ? from->height : from->width);
    block.step[2] = (float)radius;
    float weights[BLUR_MAX_RADIUS + 1];
    blur_weights(radius, weights);
    _Static_assert(sizeof weights == sizeof block.weights, "a weight for every distance");
    memcpy(block.weights, weights, sizeof weights);
    struct pass_texture source = {UNIT_SOURCE, from->name, GL_SAMPLE_NEAREST};
    return pass_fill(ctx,
        &(struct pass_fill){.name = "blur",
            .fragment = "blur.frag",
            .stage = PEN_STAGE_SHADOW,
            .textures = &source,
            .texture_count = 1,
            .framebuffer = framebuffer,
            .width = from->width,
            .height = from->height,
            .extra = &block,
            .extra_bytes = sizeof block},
        error);
}

/* As GenerateTextureMipmap makes them, but one after the other: llvmpipe keeps alive what it draws from
 * and into until it has as many drawings under way again, and of an array those are hundreds. */
static bool step_by_step(
    struct technique_ctx *ctx, const struct gl_texture *t, struct pen_error *error)
{
    GLuint framebuffers[2];
    bool ok = true;
    gl.CreateFramebuffers(2, framebuffers);
    for (uint32_t i = 0, layers = t->layers ? t->layers : 1; ok && i < layers * (t->levels - 1);
         i++) {
        GLint sizes[2][2];
        for (uint32_t k = 0; k < 2; k++) {
            uint32_t level = i / layers + k, layer = i % layers;
            sizes[k][0] = (GLint)(t->width >> level ? t->width >> level : 1);
            sizes[k][1] = (GLint)(t->height >> level ? t->height >> level : 1);
            if (t->layers)
                gl.NamedFramebufferTextureLayer(
                    framebuffers[k], GL_COLOR_ATTACHMENT0, t->name, (GLint)level, (GLint)layer);
            else
                gl.NamedFramebufferTexture(
                    framebuffers[k], GL_COLOR_ATTACHMENT0, t->name, (GLint)level);
        }
        gl.BlitNamedFramebuffer(framebuffers[0], framebuffers[1], 0, 0, sizes[0][0], sizes[0][1], 0,
            0, sizes[1][0], sizes[1][1], GL_COLOR_BUFFER_BIT, GL_LINEAR);
        ok = pass_turn_inside(ctx, error);
    }
    gl.DeleteFramebuffers(2, framebuffers);
    return ok;
}

bool pass_mips(struct technique_ctx *ctx, const struct gl_texture *texture, const char *name,
    struct pen_error *error)
{
    bool ok = true;
    gl_timer_begin(&ctx->timer, PEN_STAGE_SHADOW, name);
    if (ctx->software)
        ok = step_by_step(ctx, texture, error);
    else
        gl.GenerateTextureMipmap(texture->name);
    gl_timer_end(&ctx->timer);
    return ok && pass_turn(ctx, error);
}

bool pass_blur(struct technique_ctx *ctx, const struct gl_texture *texture, uint32_t radius,
    struct pen_error *error)
{
    bool ok = true;
    if (radius) {
        struct gl_texture between =
            gl_texture_create(texture->format, texture->width, texture->height, 0, 1);
        const struct gl_texture *targets[2] = {&between, texture};
        GLuint framebuffers[2] = {gl_framebuffer_create(&targets[0], 1, NULL),
            gl_framebuffer_create(&targets[1], 1, NULL)};
        ok = run(ctx, texture, framebuffers[0], radius, 0, error) &&
             run(ctx, &between, framebuffers[1], radius, 1, error);
        gl.DeleteFramebuffers(2, framebuffers);
        gl_texture_destroy(&between);
    }
    return ok && (texture->levels == 1 || pass_mips(ctx, texture, "mips", error));
}
