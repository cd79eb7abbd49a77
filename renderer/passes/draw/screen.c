#include "renderer/passes/draw/screen.h"
#include "protocol/fnv.h"
#include "renderer/passes/draw/passes.h"
#include "renderer/passes/draw/pieces.h"
#include "renderer/passes/draw/tiles.h"
#include "renderer/passes/draw/turn.h"
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
static GLuint make_extra(const void *extra, uint32_t bytes)
{
    GLuint buffer = 0;
    if (extra) {
        gl.CreateBuffers(1, &buffer);
        gl.NamedBufferStorage(buffer, bytes, extra, 0);
    }
    return buffer;
}

/* One pass over the screen, ready to be drawn in one piece or several. */
struct drawing {
    struct technique_ctx *ctx;
    GLuint program, framebuffer, extra;
    uint32_t width, height;
    uint64_t kind; /* of pass_pieces */
    bool add, under, least, mute;
    const struct gl_texture *tiles; /* NULL: all pixels */
    int32_t tile_class, tile_px;
    enum pass_where where;
    GLuint depth;
    struct pass_texture own[4]; /* what a method's pass always reads */
    uint32_t own_count;
    const struct pass_texture *textures;
    uint32_t texture_count;
};

static void bind(const struct drawing *d)
{
    bind_textures(d->ctx, d->own, d->own_count);
    bind_textures(d->ctx, d->textures, d->texture_count);
    if (d->extra)
        gl.BindBufferBase(GL_UNIFORM_BUFFER, UBO_EXTRA, d->extra);
    if (d->tiles)
        gl.BindTextureUnit(UNIT_TILES, d->tiles->name);
}

static void unbind(const struct drawing *d)
{
    unbind_samplers(d->own, d->own_count);
    unbind_samplers(d->textures, d->texture_count);
}

/* Those of the piece. The scissors would not do: llvmpipe draws points a row too far at them. */
static void draw_tiles(const struct drawing *d, const struct pass_pieces *piece)
{
    uint32_t width = d->tiles->width, height = d->tiles->height, px = (uint32_t)d->tile_px;
    uint32_t x = piece->x / px, end_x = (piece->x + piece->columns + px - 1) / px;
    uint32_t y = piece->y / px, end_y = (piece->y + piece->rows + px - 1) / px;
    end_x = end_x < width ? end_x : width;
    end_y = end_y < height ? end_y : height;
    bool across = x == 0 && end_x == width;
    /* Whole tiles: a point whose centre is outside the viewport would be lost. */
    gl.Viewport(0, 0, (GLsizei)(width * px), (GLsizei)(height * px));
    gl.Enable(GL_PROGRAM_POINT_SIZE);
    for (uint32_t rows = across ? end_y - y : 1; y < end_y; y += rows)
        gl.DrawArrays(GL_POINTS, (GLint)(y * width + x), (GLsizei)(rows * (end_x - x)));
    gl.Disable(GL_PROGRAM_POINT_SIZE);
}

static void test_depth(const struct drawing *d)
{
    if (d->where == PASS_EVERYWHERE)
        return;
    /* What is drawn lies at 0, the background's depth. Nothing is written, so that the texture may
     * be read in the same draw (OpenGL 4.5, 9.3.1). */
    gl.Enable(GL_DEPTH_TEST);
    gl.DepthFunc(d->where == PASS_SURFACES ? GL_LESS : GL_EQUAL);
    gl.DepthMask(GL_FALSE);
}

static void draw_piece(const struct drawing *d, const struct pass_pieces *piece)
{
    gl.BindFramebuffer(GL_FRAMEBUFFER, d->framebuffer);
    gl.Viewport(0, 0, (GLsizei)d->width, (GLsizei)d->height);
    gl.ClipControl(GL_UPPER_LEFT, GL_ZERO_TO_ONE);
    gl.UseProgram(d->program);
    gl.BindVertexArray(d->ctx->empty_array);
    if (d->add) {
        gl.Enable(GL_BLEND);
        gl.BlendFunc(GL_ONE, GL_ONE);
    }
    if (d->under) {
        gl.Enable(GL_BLEND);
        gl.BlendFunc(GL_ONE_MINUS_DST_ALPHA, GL_ONE);
    }
    if (d->least) {
        gl.Enable(GL_BLEND);
        gl.BlendEquation(GL_MIN);
    }
    if (d->mute)
        gl.ColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    test_depth(d);
    if (d->tiles) {
        draw_tiles(d, piece);
    } else {
        pass_pieces_aim(piece);
        gl.DrawArrays(GL_TRIANGLES, 0, 3);
    }
    gl.Disable(GL_BLEND);
    gl.BlendEquation(GL_FUNC_ADD);
    gl.ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    gl.Disable(GL_DEPTH_TEST);
    gl.DepthMask(GL_TRUE);
}

static bool draw(const struct drawing *d, struct pen_error *error)
{
    struct pass_pieces pieces;
    uint32_t turn = d->ctx->turns.number;
    bool more = true, ok = true;
    if (d->tiles)
        gl.ProgramUniform2i(d->program, LOCATION_TILE, d->tile_px, d->tile_class);
    bind(d);
    if (d->depth)
        gl.NamedFramebufferTexture(d->framebuffer, GL_DEPTH_ATTACHMENT, d->depth, 0);
    pass_pieces_begin(d->ctx, &pieces, d->width, d->height, d->kind);
    while (ok && more) {
        if (turn != d->ctx->turns.number)
            bind(d);
        turn = d->ctx->turns.number;
        draw_piece(d, &pieces);
        ok = pass_pieces_next(d->ctx, &pieces, &more, error);
    }
    if (d->depth)
        gl.NamedFramebufferTexture(d->framebuffer, GL_DEPTH_ATTACHMENT, 0, 0);
    unbind(d);
    return ok;
}

/* Equal programs with equal parameters. */
static uint64_t kind_of(GLuint program, const struct pen_technique_info *info, const void *params)
{
    uint64_t hash = pen_fnv(PEN_FNV_START, &program, sizeof program);
    return info && params ? pen_fnv(hash, params, info->struct_size) : hash;
}

bool pass_draw_tiles(struct technique_ctx *ctx, GLuint program, GLuint framebuffer,
    const struct gl_texture *tiles, int32_t tile_class, uint32_t width, uint32_t height, bool add,
    struct pen_error *error)
{
    return draw(&(struct drawing){.ctx = ctx,
                    .program = program,
                    .framebuffer = framebuffer,
                    .tiles = tiles,
                    .tile_class = tile_class,
                    .tile_px = CLASSIFY_TILE,
                    .width = width,
                    .height = height,
                    .kind = kind_of(program, NULL, NULL),
                    .add = add},
        error);
}

static void add_own(struct drawing *d, GLuint unit, GLuint name, enum gl_sampler_kind sampler)
{
    d->own[d->own_count++] = (struct pass_texture){unit, name, sampler};
}

bool pass_screen(struct technique_run *run, const struct pass_screen *pass, struct pen_error *error)
{
    if (!pass_fits(run->ctx, error))
        return false;
    struct technique_ctx *ctx = run->ctx;
    char defines[1024];
    bool fade = !pass->framebuffer && !run->technique->counts_horizon;
    snprintf(defines, sizeof defines, "#define LIGHT_SHAPE %d\n#define LIGHT_PARALLEL %d\n%s%s%s",
        run->face->shape, run->face->parallel,
        run->face->cube || run->face->omni ? "#define LIGHT_HAS_MORE\n" : "",
        fade ? "#define HORIZON_FADE\n" : "", pass->defines ? pass->defines : "");
    struct gl_program_desc desc = {.vertex = pass->tiles ? "tiles.vert" : "screen.vert",
        .fragment = "screen.frag",
        .body = pass->body,
        .defines = defines,
        .info = &run->technique->info,
        .params = run->params};
    struct drawing d = {.ctx = ctx,
        .program = gl_programs_get(ctx->programs, &desc, error),
        .framebuffer = pass->framebuffer ? pass->framebuffer : run->vis_framebuffer,
        .width = run->width,
        .height = run->height,
        .add = pass->add,
        .least = pass->least,
        .tiles = pass->tiles,
        .tile_class = TILE_UNDECIDED,
        .tile_px = pass->tile_px ? (int32_t)pass->tile_px : CLASSIFY_TILE,
        .where = PASS_SURFACES,
        .depth = run->gbuffer->depth.texture.name,
        .textures = pass->textures,
        .texture_count = pass->texture_count};
    if (!d.program)
        return false;
    d.kind = kind_of(d.program, &run->technique->info, run->params);
    d.kind = pen_fnv(d.kind, run->face->extent, sizeof run->face->extent);
    gl_timer_begin(&ctx->timer, PEN_STAGE_TECHNIQUE, pass->name);
    add_own(&d, UNIT_DEPTH, run->gbuffer->depth.texture.name, GL_SAMPLE_NEAREST);
    add_own(&d, UNIT_NORMAL, run->gbuffer->normal.texture.name, GL_SAMPLE_NEAREST);
    add_own(&d, UNIT_EMISSION, run->emission->name, GL_SAMPLE_TRILINEAR);
    if (pass->shadow)
        add_own(&d, UNIT_SHADOW, pass->shadow->name, GL_SAMPLE_NEAREST_BORDER);
    d.extra = make_extra(pass->extra, pass->extra_bytes);
    bool ok = draw(&d, error);
    gl.DeleteBuffers(1, &d.extra);
    gl_timer_end(&ctx->timer);
    return ok && pass_turn(ctx, error);
}

bool pass_fill(struct technique_ctx *ctx, const struct pass_fill *pass, struct pen_error *error)
{
    if (!pass_fits(ctx, error))
        return false;
    struct gl_program_desc desc = {.vertex = pass->tiles ? "tiles.vert" : "screen.vert",
        .fragment = pass->fragment,
        .defines = pass->defines,
        .info = pass->info,
        .params = pass->params};
    struct drawing d = {.ctx = ctx,
        .program = gl_programs_get(ctx->programs, &desc, error),
        .framebuffer = pass->framebuffer,
        .width = pass->width,
        .height = pass->height,
        .add = pass->add,
        .under = pass->under,
        .mute = pass->mute,
        .tiles = pass->tiles,
        .tile_class = TILE_UNDECIDED,
        .tile_px = pass->tile_px ? (int32_t)pass->tile_px : CLASSIFY_TILE,
        .where = pass->where,
        .depth = pass->depth,
        .textures = pass->textures,
        .texture_count = pass->texture_count};
    if (!d.program)
        return false;
    d.kind = kind_of(d.program, pass->info, pass->params);
    gl_timer_begin(&ctx->timer, pass->stage, pass->name);
    d.extra = make_extra(pass->extra, pass->extra_bytes);
    bool ok = draw(&d, error);
    gl.DeleteBuffers(1, &d.extra);
    gl_timer_end(&ctx->timer);
    return ok && pass_turn(ctx, error);
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
