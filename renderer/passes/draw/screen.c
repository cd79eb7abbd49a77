#include "renderer/passes/draw/screen.h"
#include "renderer/passes/draw/passes.h"
#include "renderer/passes/draw/tiles.h"
#include <stdio.h>

static void bind_textures(
    struct technique_ctx *ctx, const struct pass_texture *textures, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        gl.BindTextureUnit(textures[i].unit, textures[i].name);
        gl.BindSampler(textures[i].unit, ctx->samplers.names[textures[i].sampler]);
    }
}

static void unbind_samplers(const struct pass_texture *textures, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++)
        gl.BindSampler(textures[i].unit, 0);
}

/* The uniform block of one pass; small and short-lived, so it is made anew. */
static GLuint bind_extra(const void *extra, uint32_t bytes)
{
    GLuint buffer = 0;
    if (extra) {
        gl.CreateBuffers(1, &buffer);
        gl.NamedBufferStorage(buffer, bytes, extra, 0);
        gl.BindBufferBase(GL_UNIFORM_BUFFER, UBO_EXTRA, buffer);
    }
    return buffer;
}

static void begin(struct technique_ctx *ctx, GLuint program, GLuint framebuffer, uint32_t width,
    uint32_t height, bool add)
{
    gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    gl.Viewport(0, 0, (GLsizei)width, (GLsizei)height);
    gl.ClipControl(GL_UPPER_LEFT, GL_ZERO_TO_ONE);
    gl.UseProgram(program);
    gl.BindVertexArray(ctx->empty_array);
    if (add) {
        gl.Enable(GL_BLEND);
        gl.BlendFunc(GL_ONE, GL_ONE);
    }
}

static void draw(struct technique_ctx *ctx, GLuint program, GLuint framebuffer, uint32_t width,
    uint32_t height, bool add)
{
    begin(ctx, program, framebuffer, width, height, add);
    gl.DrawArrays(GL_TRIANGLES, 0, 3);
    gl.Disable(GL_BLEND);
}

void pass_draw_tiles(struct technique_ctx *ctx, GLuint program, GLuint framebuffer,
    const struct gl_texture *tiles, int32_t tile_class, uint32_t width, uint32_t height, bool add)
{
    gl.BindTextureUnit(UNIT_TILES, tiles->name);
    gl.ProgramUniform2i(program, LOCATION_TILE, CLASSIFY_TILE, tile_class);
    begin(ctx, program, framebuffer, width, height, add);
    /* Whole tiles: a point whose centre is outside the viewport would be lost. */
    gl.Viewport(
        0, 0, (GLsizei)tiles->width * CLASSIFY_TILE, (GLsizei)tiles->height * CLASSIFY_TILE);
    gl.Enable(GL_PROGRAM_POINT_SIZE);
    gl.DrawArrays(GL_POINTS, 0, (GLsizei)(tiles->width * tiles->height));
    gl.Disable(GL_PROGRAM_POINT_SIZE);
    gl.Disable(GL_BLEND);
}

bool pass_screen(struct technique_run *run, const struct pass_screen *pass, struct pen_error *error)
{
    struct technique_ctx *ctx = run->ctx;
    char defines[1024];
    bool fade = !pass->framebuffer && !run->technique->counts_horizon;
    snprintf(defines, sizeof defines, "#define LIGHT_SHAPE %d\n#define LIGHT_PARALLEL %d\n%s%s",
        run->face->shape, run->face->parallel, fade ? "#define HORIZON_FADE\n" : "",
        pass->defines ? pass->defines : "");
    struct gl_program_desc desc = {.vertex = pass->tiles ? "tiles.vert" : "screen.vert",
        .fragment = "screen.frag",
        .body = pass->body,
        .defines = defines,
        .info = &run->technique->info,
        .params = run->params};
    GLuint program = gl_programs_get(ctx->programs, &desc, error);
    if (!program)
        return false;
    gl_timer_begin(&ctx->timer, PEN_STAGE_TECHNIQUE, pass->name);
    gl.BindTextureUnit(UNIT_DEPTH, run->gbuffer->depth.texture.name);
    gl.BindTextureUnit(UNIT_NORMAL, run->gbuffer->normal.texture.name);
    gl.BindTextureUnit(UNIT_EMISSION, run->emission->name);
    gl.BindSampler(UNIT_EMISSION, ctx->samplers.names[GL_SAMPLE_TRILINEAR]);
    if (pass->shadow) {
        gl.BindTextureUnit(UNIT_SHADOW, pass->shadow->name);
        gl.BindSampler(UNIT_SHADOW, ctx->samplers.names[GL_SAMPLE_NEAREST_BORDER]);
    }
    bind_textures(ctx, pass->textures, pass->texture_count);
    GLuint extra = bind_extra(pass->extra, pass->extra_bytes);
    GLuint framebuffer = pass->framebuffer ? pass->framebuffer : run->vis_framebuffer;
    if (pass->tiles)
        pass_draw_tiles(ctx, program, framebuffer, pass->tiles, TILE_UNDECIDED, run->width,
            run->height, pass->add);
    else
        draw(ctx, program, framebuffer, run->width, run->height, pass->add);
    unbind_samplers(pass->textures, pass->texture_count);
    gl.BindSampler(UNIT_EMISSION, 0);
    gl.BindSampler(UNIT_SHADOW, 0);
    gl.DeleteBuffers(1, &extra);
    gl_timer_end(&ctx->timer);
    return true;
}

bool pass_fill(struct technique_ctx *ctx, const struct pass_fill *pass, struct pen_error *error)
{
    struct gl_program_desc desc = {.vertex = "screen.vert",
        .fragment = pass->fragment,
        .defines = pass->defines,
        .info = pass->info,
        .params = pass->params};
    GLuint program = gl_programs_get(ctx->programs, &desc, error);
    if (!program)
        return false;
    gl_timer_begin(&ctx->timer, pass->stage, pass->name);
    bind_textures(ctx, pass->textures, pass->texture_count);
    GLuint extra = bind_extra(pass->extra, pass->extra_bytes);
    draw(ctx, program, pass->framebuffer, pass->width, pass->height, pass->add);
    unbind_samplers(pass->textures, pass->texture_count);
    gl.DeleteBuffers(1, &extra);
    gl_timer_end(&ctx->timer);
    return true;
}

const struct gl_target *pass_sum(struct technique_run *run)
{
    static const struct pass_targets key = {1};
    static const float zero[4] = {0};
    struct gl_target *sum = pass_targets(run->ctx, &key);
    gl_target_fit(sum, GL_RGBA32F, run->width, run->height, 0, 1);
    gl_target_clear(sum, zero);
    return sum;
}

bool pass_is_first_face(const struct technique_run *run)
{
    return run->face == run->light->faces;
}

bool pass_is_last_face(const struct technique_run *run)
{
    return run->face == run->light->faces + run->light->face_count - 1;
}
