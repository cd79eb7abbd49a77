/* The shared blocks that methods are made of. Every one times itself. */
#pragma once
#include "renderer/passes/map/shadow_cache.h"

struct pass_texture {
    GLuint unit; /* UNIT_FREE and up */
    GLuint name;
    enum gl_sampler_kind sampler;
};

/* A full-screen pass over this face's receivers. `body` defines
 *     vec4 visibility(Surface s)      (see surface.glsl, light.glsl)
 * and is compiled with the method's parameters as P(name). Writes run->vis_framebuffer unless
 * `framebuffer` is given. */
struct pass_screen {
    const char *name;                /* of the pass, for the timing record */
    const char *body;                /* "pcss.glsl" */
    const char *defines;             /* or NULL */
    const struct gl_texture *shadow; /* depth map on UNIT_SHADOW, or NULL */
    const struct pass_texture *textures;
    uint32_t texture_count;
    GLuint framebuffer;             /* 0: run->vis_framebuffer */
    bool add;                       /* blends ONE, ONE instead of replacing */
    const struct gl_texture *tiles; /* of pass_classify: only undecided tiles are drawn; or NULL */
    const void *extra;              /* contents of the uniform block UBO_EXTRA, or NULL */
    uint32_t extra_bytes;
};
bool pass_screen(
    struct technique_run *run, const struct pass_screen *pass, struct pen_error *error);

/* As pass_screen, but over all pixels and without a Surface: the file `fragment` is a whole
 * fragment shader. Stage and framebuffer are the caller's choice. */
struct pass_fill {
    const char *name, *fragment, *defines;
    enum pen_stage stage;
    const struct pass_texture *textures;
    uint32_t texture_count;
    GLuint framebuffer;
    uint32_t width, height;
    bool add;
    const void *extra;
    uint32_t extra_bytes;
    const struct pen_technique_info *info; /* parameters for P(name), or NULL */
    const void *params;
};
bool pass_fill(struct technique_ctx *ctx, const struct pass_fill *pass, struct pen_error *error);

/* The accumulator ctx->sum (RGBA32F, the size of the picture), cleared to 0: the framebuffer of
 * passes that add. */
GLuint pass_clear_sum(struct technique_run *run);

/* Draws the tiles of one class (enum tile_class) of an image of width x height pixels. */
void pass_draw_tiles(struct technique_ctx *ctx, GLuint program, GLuint framebuffer,
    const struct gl_texture *tiles, int32_t tile_class, uint32_t width, uint32_t height, bool add);

/* Depth map seen from the light's centre, size x size, D32F in textures[0]: 0 at near_z, 1 at far_z
 * and where nothing is. Kept between requests. */
const struct shadow_input *pass_depth_map(
    struct technique_run *run, uint32_t size, struct pen_error *error);

/* The same without backdrops (light_find_backdrops): for methods that compare depths, where what
 * cannot cast only costs time and bias. Methods that filter depths want pass_depth_map. */
const struct shadow_input *pass_caster_map(
    struct technique_run *run, uint32_t size, struct pen_error *error);

/* Draws the casters seen from `sample` through `rect` into a D32F framebuffer (cleared here). */
bool pass_draw_casters(struct technique_run *run, GLuint framebuffer, uint32_t size,
    const float sample[2], const float rect[4], bool backdrops, struct pen_error *error);

/* Depth peeling, one layer: what of the casters lies behind the 2D depth texture `layer_before` of
 * the same size, far sides included, seen from the light's centre. */
bool pass_draw_casters_behind(struct technique_run *run, GLuint framebuffer, uint32_t size,
    GLuint layer_before, struct pen_error *error);

/* Min and max of linear z (metres from the light's plane; texels where nothing is: 1e30) over 2^k x
 * 2^k texels: RG32F with the whole mip chain in textures[0]; level 0 has half the map's side. */
const struct shadow_input *pass_min_max(
    struct technique_run *run, uint32_t size, struct pen_error *error);
/* The same over pass_caster_map. */
const struct shadow_input *pass_caster_min_max(
    struct technique_run *run, uint32_t size, struct pen_error *error);
/* Fills that pyramid from a depth map of size x size; the light block (near_z, far_z) is
 * bound. Cell i of level k is over texels i 2^(k + 1) and up; the last of a row takes what
 * is left over. */
bool pass_min_max_levels(struct technique_ctx *ctx, const struct gl_texture *depth, uint32_t size,
    const struct gl_texture *pyramid, struct pen_error *error);

/* The G-buffer of the frame. */
bool pass_gbuffer(struct technique_ctx *ctx, struct scene *scene, const struct view *view,
    bool ground, struct gbuffer *gbuffer, uint64_t *triangles, struct pen_error *error);
