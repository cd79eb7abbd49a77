#include "renderer/passes/draw/scratch.h"

const struct gl_texture *pass_scratch(
    struct technique_run *run, enum pass_scratch_slot slot, GLenum format, uint32_t levels)
{
    struct gl_texture *texture = &run->ctx->scratch[slot];
    gl_texture_fit(texture, format, run->width, run->height, 0, levels);
    return texture;
}

void pass_scratch_clear(const struct gl_texture *texture, const float value[4])
{
    GLuint framebuffer = gl_framebuffer_create(&texture, 1, NULL);
    gl.ClearNamedFramebufferfv(framebuffer, GL_COLOR, 0, value);
    gl.DeleteFramebuffers(1, &framebuffer);
}

void pass_scratch_finish(struct technique_ctx *ctx)
{
    for (uint32_t i = 0; i < SCRATCH_SLOTS; i++)
        gl_texture_destroy(&ctx->scratch[i]);
}

bool pass_is_first_face(const struct technique_run *run)
{
    return run->face == run->light->faces;
}

bool pass_is_last_face(const struct technique_run *run)
{
    return run->face == run->light->faces + run->light->face_count - 1;
}
