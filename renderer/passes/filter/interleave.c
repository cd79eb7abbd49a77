#include "renderer/passes/filter/interleave.h"
#include "renderer/passes/draw/passes.h"
#include "renderer/passes/map/classify.h"
#include <stdio.h>
#include <string.h>

static bool interleaved(
    struct technique_run *run, const struct pass_screen *pass, bool colour, struct pen_error *error)
{
    char defines[512];
    snprintf(
        defines, sizeof defines, "#define INTERLEAVED\n%s", pass->defines ? pass->defines : "");
    static const struct pass_targets key = {1};
    struct gl_target *target = pass_targets(run->ctx, &key);
    GLenum format = colour ? GL_RGBA32F : GL_RG16F;
    gl_target_fit(target, format, run->width, run->height, 0, 1);
    /* Lit, no penumbra. */
    float lit[4] = {1, 0, 0, 1};
    if (colour)
        memcpy(lit, run->face->emission_mean, sizeof lit);
    gl_target_clear(target, lit);
    struct pass_screen first = *pass;
    first.defines = defines;
    first.framebuffer = target->framebuffer;
    char second_defines[64];
    snprintf(second_defines, sizeof second_defines, "%s%s", colour ? "#define COLOUR\n" : "",
        run->face->cube ? "#define CUBE\n" : "");
    struct pass_texture source = {UNIT_SOURCE, target->texture.name, GL_SAMPLE_NEAREST};
    struct pass_screen second = {.name = "interleave",
        .body = "interleave.glsl",
        .defines = second_defines,
        .textures = &source,
        .texture_count = 1,
        .tiles = pass->tiles};
    if (pass->tiles && !pass_fill_umbra(run, pass->tiles, target->framebuffer, error))
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
