#include "renderer/gl/target.h"
#include <string.h>

static uint64_t all_bytes;

static GLenum attachment_of(const struct gl_texture *texture)
{
    return texture->format == GL_DEPTH_COMPONENT32F ? GL_DEPTH_ATTACHMENT : GL_COLOR_ATTACHMENT0;
}

static void attach(struct gl_target *target)
{
    const struct gl_texture *t = &target->texture;
    bool depth = attachment_of(t) == GL_DEPTH_ATTACHMENT;
    all_bytes += t->bytes;
    target->framebuffer = gl_framebuffer_create(&t, depth ? 0 : 1, depth ? t : NULL);
}

bool gl_target_fit(struct gl_target *target, GLenum format, uint32_t width, uint32_t height,
    uint32_t layers, uint32_t levels)
{
    const struct gl_texture *t = &target->texture;
    if (t->name && t->format == format && t->width == width && t->height == height &&
        t->layers == layers && (!levels || t->levels == levels))
        return false;
    gl_target_destroy(target);
    target->texture = gl_texture_create(format, width, height, layers, levels);
    attach(target);
    if (layers)
        gl_target_aim(target, 0, 0);
    return true;
}

bool gl_target_fit_samples(
    struct gl_target *target, GLenum format, uint32_t width, uint32_t height, uint32_t samples)
{
    const struct gl_texture *t = &target->texture;
    if (t->name && t->format == format && t->width == width && t->height == height)
        return false;
    gl_target_destroy(target);
    target->texture = gl_texture_create_samples(format, width, height, samples);
    attach(target);
    return true;
}

void gl_target_destroy(struct gl_target *target)
{
    if (!target || !target->texture.name)
        return;
    gl.DeleteFramebuffers(1, &target->framebuffer);
    all_bytes -= target->texture.bytes;
    gl_texture_destroy(&target->texture);
    memset(target, 0, sizeof *target);
}

void gl_target_aim(const struct gl_target *target, uint32_t level, uint32_t layer)
{
    const struct gl_texture *t = &target->texture;
    if (t->layers)
        gl.NamedFramebufferTextureLayer(
            target->framebuffer, attachment_of(t), t->name, (GLint)level, (GLint)layer);
    else
        gl.NamedFramebufferTexture(target->framebuffer, attachment_of(t), t->name, (GLint)level);
}

void gl_target_clear(const struct gl_target *target, const float value[4])
{
    gl.ClearNamedFramebufferfv(target->framebuffer, GL_COLOR, 0, value);
}

uint64_t gl_targets_bytes(void)
{
    return all_bytes;
}
