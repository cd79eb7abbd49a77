#include "renderer/passes/filter/interleave.h"
#include "renderer/passes/map/classify.h"
#include <stdio.h>
#include <string.h>

static bool interleaved(
    struct technique_run *run, const struct pass_screen *pass, bool colour, struct pen_error *error)
{
    struct technique_ctx *ctx = run->ctx;
    char defines[512];
    snprintf(
        defines, sizeof defines, "#define INTERLEAVED\n%s", pass->defines ? pass->defines : "");
    GLenum format = colour ? GL_RGBA32F : GL_RG16F;
    if (gl_texture_fit(&ctx->interleaved, format, run->width, run->height, 0, 1) ||
        !ctx->interleaved_framebuffer) {
        gl.DeleteFramebuffers(1, &ctx->interleaved_framebuffer);
        const struct gl_texture *color = &ctx->interleaved;
        ctx->interleaved_framebuffer = gl_framebuffer_create(&color, 1, NULL);
    }
    /* Lit, no penumbra. */
    float lit[4] = {1, 0, 0, 1};
    if (colour)
        memcpy(lit, run->face->emission_mean, sizeof lit);
    gl.ClearNamedFramebufferfv(ctx->interleaved_framebuffer, GL_COLOR, 0, lit);
    struct pass_screen first = *pass;
    first.defines = defines;
    first.framebuffer = ctx->interleaved_framebuffer;
    struct pass_texture source = {UNIT_FREE, ctx->interleaved.name, GL_SAMPLE_NEAREST};
    struct pass_screen second = {.name = "interleave",
        .body = "interleave.glsl",
        .defines = colour ? "#define COLOUR\n" : NULL,
        .textures = &source,
        .texture_count = 1,
        .tiles = pass->tiles};
    if (pass->tiles && !pass_fill_umbra(run, pass->tiles, ctx->interleaved_framebuffer, error))
        return false;
    return pass_screen(run, &first, error) && pass_screen(run, &second, error);
}

bool pass_interleaved(
    struct technique_run *run, const struct pass_screen *pass, struct pen_error *error)
{
    return interleaved(run, pass, false, error);
}

bool pass_interleaved_colour(
    struct technique_run *run, const struct pass_screen *pass, struct pen_error *error)
{
    return interleaved(run, pass, true, error);
}
