#include "renderer/passes/map/depth_map.h"
#include "protocol/memory.h"
#include "renderer/passes/draw/turn.h"
#include "renderer/passes/map/shadow_cache.h"
#include <cglm/cglm.h>
#include <stdlib.h>
#include <string.h>

#define FIRST_PIXELS (1u << 22)

static GLuint program(struct technique_ctx *ctx, const char *defines, struct pen_error *error)
{
    struct gl_program_desc desc = {
        .vertex = "geometry.vert", .fragment = "depth.frag", .defines = defines};
    return gl_programs_get(ctx->programs, &desc, error);
}

/* What is drawn into a map. */
struct drawing {
    GLuint framebuffer;
    uint32_t size;
    const float *sample, *rect;
    GLuint layer_before; /* a depth texture that the drawn surfaces must lie behind, or 0 */
    struct scene_pass pass;
};

static void draw_piece(struct technique_run *run, const struct drawing *d, struct pass_bands *bands)
{
    struct cull_view cull;
    light_face_cull(run->face, d->sample, d->rect, &cull);
    cull.faces = run->request->casters == PEN_CASTERS_FRONT ? CULL_SINGLE_SIDED : CULL_CLOSED;
    if (d->layer_before) {
        /* Behind the first layer the far sides count too: they close the casters. */
        cull.faces = CULL_NONE;
        gl.BindTextureUnit(UNIT_SOURCE, d->layer_before);
    }
    GLuint programs[] = {d->pass.opaque, d->pass.textured};
    for (int i = 0; i < 2; i++)
        gl.ProgramUniformMatrix4fv(
            programs[i], LOCATION_TO_CLIP, 1, GL_FALSE, (const float *)cull.world_to_clip);
    pass_bands_crop(bands, -1, 0, d->size, cull.world_to_clip);
    /* Maps that are averaged cut blended surfaces at different thresholds. */
    uint32_t seed;
    float mixed = d->sample[0] * 7919.0f + d->sample[1] * 104729.0f;
    memcpy(&seed, &mixed, 4);
    gl.ProgramUniform1ui(d->pass.textured, LOCATION_SEED, seed);
    gl.BindFramebuffer(GL_FRAMEBUFFER, d->framebuffer);
    gl.Viewport(0, 0, (GLsizei)d->size, (GLsizei)d->size);
    gl.ClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    gl.DepthMask(GL_TRUE);
    gl.Enable(GL_DEPTH_TEST);
    gl.DepthFunc(GL_LESS);
    gl.Enable(GL_DEPTH_CLAMP); /* casters nearer than the near plane still cast */
    pass_bands_aim(bands);
    scene_draw(run->scene, &cull, &d->pass, &bands->piece);
    gl.Disable(GL_DEPTH_CLAMP);
    gl.Disable(GL_DEPTH_TEST);
    gl.ClipControl(GL_UPPER_LEFT, GL_ZERO_TO_ONE);
}

static bool draw(
    struct technique_run *run, struct drawing *d, bool backdrops, struct pen_error *error)
{
    static const float one[4] = {1};
    const char *peel = d->layer_before ? "#define PEEL\n" : NULL;
    if (!pass_fits(run->ctx, error))
        return false;
    /* Light space looks along +z, which mirrors the image: front faces come out clockwise. */
    d->pass.front_is_clockwise = true;
    d->pass.opaque = program(run->ctx, peel, error);
    d->pass.textured =
        program(run->ctx, peel ? "#define PEEL\n#define ALPHA\n" : "#define ALPHA\n", error);
    if (!d->pass.opaque || !d->pass.textured)
        return false;
    bool *hidden = NULL;
    if (!backdrops) {
        hidden = pen_alloc_zero(run->scene->blob.instance_count + 1, sizeof *hidden);
        light_find_backdrops(run->light, run->scene, hidden);
        d->pass.hidden = hidden;
    }
    gl.DepthMask(GL_TRUE);
    gl.ClearNamedFramebufferfv(d->framebuffer, GL_DEPTH, 0, one);
    struct pass_bands bands;
    bool more = true, ok = true;
    pass_bands_begin(run->ctx, &bands, d->size, d->size, FIRST_PIXELS, d->pass.opaque);
    while (ok && more) {
        draw_piece(run, d, &bands);
        ok = pass_bands_next(run->ctx, &bands, &more, error);
    }
    free(hidden);
    return ok;
}

bool pass_draw_casters(struct technique_run *run, GLuint framebuffer, uint32_t size,
    const float sample[2], const float rect[4], bool backdrops, struct pen_error *error)
{
    struct drawing d = {framebuffer, size, sample, rect, 0, {0}};
    return draw(run, &d, backdrops, error);
}

bool pass_draw_casters_behind(struct technique_run *run, GLuint framebuffer, uint32_t size,
    GLuint layer_before, struct pen_error *error)
{
    static const float center[2] = {0, 0};
    struct drawing d = {framebuffer, size, center, run->face->rect, layer_before, {0}};
    return draw(run, &d, false, error);
}

static bool build_depth(struct technique_run *run, const struct shadow_key *key,
    struct shadow_input *input, struct pen_error *error)
{
    static const float center[2] = {0, 0};
    gl_timer_begin(&run->ctx->timer, PEN_STAGE_SHADOW, "shadow map");
    input->textures[0] = gl_texture_create(GL_DEPTH_COMPONENT32F, key->size, key->size, 0, 1);
    GLuint framebuffer = gl_framebuffer_create(NULL, 0, &input->textures[0]);
    bool ok = pass_draw_casters(
        run, framebuffer, key->size, center, run->face->rect, key->extra[0] == 0, error);
    gl.DeleteFramebuffers(1, &framebuffer);
    gl_timer_end(&run->ctx->timer);
    return ok && pass_turn(run->ctx, error);
}

const struct shadow_input *pass_depth_map(
    struct technique_run *run, uint32_t size, struct pen_error *error)
{
    struct shadow_key key = {.kind = "depth", .size = size, .of_centre = true};
    run->map_size = size;
    return shadow_cache_get(run, &key, build_depth, error);
}

const struct shadow_input *pass_caster_map(
    struct technique_run *run, uint32_t size, struct pen_error *error)
{
    struct shadow_key key = {.kind = "depth", .size = size, .of_centre = true, .extra = {1}};
    run->map_size = size;
    return shadow_cache_get(run, &key, build_depth, error);
}
