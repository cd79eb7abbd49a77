#include "renderer/passes/draw/places.h"
#include "renderer/passes/draw/turn.h"
#include <string.h>

#define COVER_KIND UINT64_MAX
#define FIRST_PIXELS (1u << 18)

static GLuint program(struct technique_ctx *ctx, const char *defines, struct pen_error *error)
{
    struct gl_program_desc desc = {
        .vertex = "geometry.vert", .fragment = "places.frag", .defines = defines};
    return gl_programs_get(ctx->programs, &desc, error);
}

static void find_places(const struct gl_target *depths, struct edges_block *where)
{
    gl.BindFramebuffer(GL_FRAMEBUFFER, depths->framebuffer);
    for (GLuint i = 0; i < EDGE_PLACES; i++) {
        float at[2];
        gl.GetMultisamplefv(GL_SAMPLE_POSITION, i, at);
        where->across[i] = at[0] - 0.5f;
        where->down[i] = at[1] - 0.5f;
    }
}

static void draw_piece(struct technique_ctx *ctx, struct scene *scene, const struct view *view,
    const struct scene_pass *pass, GLuint ground, uint32_t first, struct pass_bands *bands,
    const struct gl_target *depths, GLuint block)
{
    GLuint programs[] = {pass->opaque, pass->textured, ground};
    struct cull_view cull;
    view_to_cull(view, &cull);
    pass_bands_crop(bands, 1, first, view->height, cull.world_to_clip);
    for (int i = 0; i < 3; i++)
        if (programs[i])
            gl.ProgramUniformMatrix4fv(
                programs[i], LOCATION_TO_CLIP, 1, GL_FALSE, (const float *)view->world_to_clip);
    gl.BindFramebuffer(GL_FRAMEBUFFER, depths->framebuffer);
    gl.BindBufferBase(GL_UNIFORM_BUFFER, UBO_EXTRA, block);
    gl.Viewport(0, -(GLint)first, (GLsizei)view->width, (GLsizei)view->height);
    gl.ClipControl(GL_UPPER_LEFT, GL_ZERO_TO_ONE);
    gl.DepthMask(GL_TRUE);
    gl.Enable(GL_DEPTH_TEST);
    gl.DepthFunc(GL_GREATER);
    pass_bands_aim(bands);
    scene_draw(scene, &cull, pass, &bands->piece);
    if (ground && !bands->piece.more) {
        gl.UseProgram(ground);
        gl.BindVertexArray(ctx->empty_array);
        gl.DrawArrays(GL_TRIANGLE_STRIP, 0, 4);
    }
    gl.Disable(GL_DEPTH_TEST);
}

static void cover_ground(const struct scene *scene, const struct cover *cover)
{
    float g[4];
    scene_ground(scene, g);
    g[1] = scene_ground_top(scene);
    const float corners[4][3] = {{g[0] - g[3], g[1], g[2] + g[3]}, {g[0] + g[3], g[1], g[2] + g[3]},
        {g[0] - g[3], g[1], g[2] - g[3]}, {g[0] + g[3], g[1], g[2] - g[3]}};
    cover_one_triangle(corners, cover);
    cover_one_triangle(corners + 1, cover);
}

bool pass_cover(struct technique_ctx *ctx, struct scene *scene, const struct view *view,
    const struct places_pass *which, struct cover_tile *tiles, cover_places *depths, float *least,
    struct pen_error *error)
{
    const struct cover_scene what = {.blended = which->kind == PLACES_BLENDED,
        .threshold = which->kind == PLACES_SOLID ? SOLID_PER_MILLE / 1000.0f : 0};
    struct cover cover = {.width = view->width,
        .height = view->height,
        .tiles = tiles,
        .depths = depths,
        .least = least};
    struct pass_bands bands;
    bool more = true, ok = true;
    memcpy(cover.world_to_clip, view->world_to_clip, sizeof cover.world_to_clip);
    gl_timer_begin(&ctx->timer, PEN_STAGE_GBUFFER, "edge places");
    pass_bands_begin(ctx, &bands, view->width, which->rows, view->width * which->rows, COVER_KIND);
    bands.by_hand = true;
    while (ok && more) {
        struct cull_view cull;
        view_to_cull(view, &cull);
        pass_bands_crop(&bands, 1, which->first, view->height, cull.world_to_clip);
        cover.first = which->first + bands.y;
        cover.rows = bands.rows;
        cover_scene(scene, &cull, &what, &cover, &bands.piece);
        if (which->ground && !bands.piece.more)
            cover_ground(scene, &cover);
        ok = pass_bands_next(ctx, &bands, &more, error);
    }
    gl_timer_end(&ctx->timer);
    return ok && pass_turn(ctx, error);
}

bool pass_places(struct technique_ctx *ctx, struct scene *scene, const struct view *view,
    const struct places_pass *which, struct gl_target *depths, struct edges_block *where,
    struct pen_error *error)
{
    static const float zero[4] = {0};
    enum places_kind kind = which->kind;
    uint32_t first = which->first, rows = which->rows;
    const char *alpha = kind == PLACES_SOLID ? "#define ALPHA\n#define SOLID\n" : "#define ALPHA\n";
    struct scene_pass pass = {.opaque = program(ctx, NULL, error),
        .textured = program(ctx, alpha, error),
        .blended = kind == PLACES_BLENDED};
    GLuint flat = program(ctx, "#define FULL\n#define GROUND\n#define TOP\n", error), block;
    if (!pass.opaque || !pass.textured || !flat)
        return false;
    gl_timer_begin(&ctx->timer, PEN_STAGE_GBUFFER, "edge places");
    gl_target_fit_samples(depths, GL_DEPTH_COMPONENT32F, view->width, rows, EDGE_PLACES);
    find_places(depths, where);
    where->rows[0] = (int32_t)first;
    where->rows[1] = (int32_t)rows;
    gl.CreateBuffers(1, &block);
    gl.NamedBufferStorage(block, sizeof *where, where, 0);
    gl.DepthMask(GL_TRUE);
    gl.ClearNamedFramebufferfv(depths->framebuffer, GL_DEPTH, 0, zero);
    struct pass_bands bands;
    bool more = true, ok = true;
    pass_bands_begin(ctx, &bands, view->width, rows, FIRST_PIXELS, pass.opaque);
    while (ok && more) {
        draw_piece(ctx, scene, view, &pass, which->ground && !pass.blended ? flat : 0, first,
            &bands, depths, block);
        ok = pass_bands_next(ctx, &bands, &more, error);
    }
    gl.DeleteBuffers(1, &block);
    gl_timer_end(&ctx->timer);
    return ok && pass_turn(ctx, error);
}
