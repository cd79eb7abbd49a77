#include "renderer/passes/draw/gbuffer.h"
#include "renderer/passes/draw/turn.h"
#include <stdio.h>
#include <string.h>

#define FIRST_PIXELS (1u << 15)

/* True when memory was taken. */
static bool fit(
    struct gbuffer *g, uint32_t width, uint32_t height, bool emission, enum gbuffer_kind kind)
{
    bool made = gl_target_fit(&g->depth, GL_DEPTH_COMPONENT32F, width, height, 0, 1);
    made |= gl_target_fit(&g->normal, GL_RGBA16, width, height, 0, 1);
    made |= gl_target_fit(
        &g->albedo, kind == GBUFFER_LAYER ? GL_RGBA16 : GL_RGBA8, width, height, 0, 1);
    made |= gl_target_fit(&g->surface, GL_RGBA8, width, height, 0, 1);
    if (emission)
        made |= gl_target_fit(&g->emission, GL_R11F_G11F_B10F, width, height, 0, 1);
    else if (g->emission.texture.name) {
        gl_target_destroy(&g->emission);
        made = true;
    }
    if (!made && g->framebuffer)
        return false;
    gl.DeleteFramebuffers(1, &g->framebuffer);
    const struct gl_texture *colors[] = {
        &g->normal.texture, &g->albedo.texture, &g->surface.texture, &g->emission.texture};
    g->framebuffer = gl_framebuffer_create(colors, emission ? 4 : 3, &g->depth.texture);
    return true;
}

/* Not of layers, which depend on depths besides. */
static struct gbuffer_view make_view(const struct technique_ctx *ctx, const struct scene *scene,
    const struct view *view, const struct gbuffer_pass *how)
{
    struct gbuffer_view v;
    memset(&v, 0, sizeof v); /* is compared as bytes */
    if (how->kind == GBUFFER_LAYER)
        return v;
    memcpy(v.scene, scene->id, sizeof v.scene);
    v.known = 1, v.kind = how->kind, v.ground = how->ground;
    v.number = scene->has_blend ? ctx->turns.frame : 0;
    v.width = view->width, v.height = view->height;
    v.animation = scene->pose.animation, v.variant = scene->pose.variant;
    v.time_s = scene->pose.time_s;
    memcpy(v.world_to_clip, view->world_to_clip, sizeof v.world_to_clip);
    memcpy(v.eye, view->eye, sizeof v.eye);
    memcpy(v.ground_albedo, how->ground_albedo, sizeof v.ground_albedo);
    return v;
}

static GLuint program(struct technique_ctx *ctx, const char *use, bool emission,
    enum gbuffer_kind kind, struct pen_error *error)
{
    static const char *const kinds[] = {"", "#define SOLID\n", "#define LAYER\n"};
    char defines[128];
    snprintf(defines, sizeof defines, "#define FULL\n%s%s%s", emission ? "#define EMIT\n" : "", use,
        kinds[kind]);
    struct gl_program_desc desc = {
        .vertex = "geometry.vert", .fragment = "gbuffer.frag", .defines = defines};
    return gl_programs_get(ctx->programs, &desc, error);
}

static void set_matrix(GLuint program, const mat4 matrix)
{
    gl.ProgramUniformMatrix4fv(program, LOCATION_TO_CLIP, 1, GL_FALSE, (const float *)matrix);
}

/* Programs of the ground; 0: none. */
struct ground_pass {
    GLuint seen, top;
};

static void draw_ground(struct technique_ctx *ctx, const struct view *view,
    const struct ground_pass *ground, const struct gbuffer *g)
{
    const GLuint programs[] = {ground->seen, ground->top};
    gl.BindVertexArray(ctx->empty_array);
    for (int i = 0; i < 2; i++) {
        if (i) {
            gl.BindFramebuffer(GL_FRAMEBUFFER, g->depth.framebuffer);
            gl.BindTextureUnit(UNIT_ALBEDO, g->albedo.texture.name);
        }
        set_matrix(programs[i], view->world_to_clip);
        gl.UseProgram(programs[i]);
        gl.DrawArrays(GL_TRIANGLE_STRIP, 0, 4);
    }
}

static uint64_t draw_piece(struct technique_ctx *ctx, struct scene *scene, const struct view *view,
    const struct scene_pass *pass, const struct ground_pass *ground, struct pass_bands *bands,
    const struct gbuffer *g)
{
    struct cull_view cull;
    view_to_cull(view, &cull);
    pass_bands_crop(bands, 1, 0, view->height, cull.world_to_clip);
    set_matrix(pass->opaque, view->world_to_clip);
    set_matrix(pass->textured, view->world_to_clip);
    gl.BindFramebuffer(GL_FRAMEBUFFER, g->framebuffer);
    gl.Viewport(0, 0, (GLsizei)view->width, (GLsizei)view->height);
    gl.ClipControl(GL_UPPER_LEFT, GL_ZERO_TO_ONE);
    gl.DepthMask(GL_TRUE);
    gl.Enable(GL_DEPTH_TEST);
    gl.DepthFunc(GL_GREATER);
    pass_bands_aim(bands);
    uint64_t triangles = scene_draw(scene, &cull, pass, &bands->piece);
    if (ground && !bands->piece.more)
        draw_ground(ctx, view, ground, g);
    gl.Disable(GL_DEPTH_TEST);
    return triangles;
}

bool pass_gbuffer(struct technique_ctx *ctx, struct scene *scene, const struct view *view,
    const struct gbuffer_pass *how, struct gbuffer *g, uint64_t *triangles, struct pen_error *error)
{
    bool emission = scene->has_emission || scene->has_unlit;
    struct gbuffer_view wanted = make_view(ctx, scene, view, how);
    bool made = fit(g, view->width, view->height, emission, how->kind);
    if (!made && wanted.known && !memcmp(&wanted, &g->shown, sizeof wanted)) {
        *triangles += g->triangles;
        return true;
    }
    g->shown.known = 0;
    g->triangles = 0;
    g->drawn++;
    if (made && !pass_turn(ctx, error))
        return false;
    struct scene_pass pass = {.full = true, .blended = how->kind == GBUFFER_LAYER};
    pass.opaque = program(ctx, "", emission, GBUFFER_HASHED, error);
    pass.textured = program(ctx, "#define TEXTURED\n", emission, how->kind, error);
    struct gl_program_desc top = {.vertex = "geometry.vert",
        .fragment = "ground_top.frag",
        .defines = "#define FULL\n#define GROUND\n#define TOP\n"};
    const struct ground_pass ground = {
        program(ctx, "#define GROUND\n", emission, GBUFFER_HASHED, error),
        gl_programs_get(ctx->programs, &top, error)};
    if (!pass.opaque || !pass.textured || !ground.seen || !ground.top)
        return false;
    gl_timer_begin(&ctx->timer, PEN_STAGE_GBUFFER, "gbuffer");
    static const float zero[4] = {0};
    gl.DepthMask(GL_TRUE);
    gl.ClearNamedFramebufferfv(g->framebuffer, GL_DEPTH, 0, zero);
    struct pass_bands bands;
    bool more = true, ok = true;
    pass_bands_begin(ctx, &bands, view->width, view->height, FIRST_PIXELS, pass.opaque);
    while (ok && more) {
        if (how->kind == GBUFFER_LAYER) {
            gl.BindTextureUnit(UNIT_BEFORE, how->before->name);
            gl.BindTextureUnit(UNIT_SOLID, how->solid->name);
            gl.ProgramUniform1i(pass.textured, LOCATION_LAST, how->last);
        }
        g->triangles +=
            draw_piece(ctx, scene, view, &pass, how->ground ? &ground : NULL, &bands, g);
        ok = pass_bands_next(ctx, &bands, &more, error);
    }
    gl_timer_end(&ctx->timer);
    *triangles += g->triangles;
    if (ok)
        g->shown = wanted;
    return ok && pass_turn(ctx, error);
}
