/* Passes over the screen. Like all passes, every one times itself. */
#pragma once
#include "renderer/technique.h"

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
    bool least;                     /* keeps the lesser of what is there and the new value */
    const struct gl_texture *tiles; /* of pass_classify: only undecided tiles are drawn; or NULL */
    uint32_t tile_px;               /* of those; 0: CLASSIFY_TILE */
    const void *extra;              /* contents of the uniform block UBO_EXTRA, or NULL */
    uint32_t extra_bytes;
};
bool pass_screen(
    struct technique_run *run, const struct pass_screen *pass, struct pen_error *error);

/* As pass_screen, but over all pixels and without a Surface: the file `fragment` is a whole
 * fragment shader. Stage and framebuffer are the caller's choice. */
/* Pixels by the G-buffer's depth, which is 0 where there is nothing. The test comes before the
 * fragment, so that the others cost next to nothing. */
enum pass_where { PASS_EVERYWHERE, PASS_SURFACES, PASS_BACKGROUND };

struct pass_fill {
    const char *name, *fragment, *defines;
    enum pen_stage stage;
    const struct pass_texture *textures;
    uint32_t texture_count;
    GLuint framebuffer;
    uint32_t width, height;
    bool add;
    bool under; /* goes behind what is there: colours times alpha, nearest first */
    bool mute;  /* no colour is written: the pass counts */
    const struct gl_texture *tiles; /* as above */
    uint32_t tile_px;
    enum pass_where where;
    GLuint depth; /* of the G-buffer, unless everywhere; may be looked up in, too */
    const void *extra;
    uint32_t extra_bytes;
    const struct pen_technique_info *info; /* parameters for P(name), or NULL */
    const void *params;
};
bool pass_fill(struct technique_ctx *ctx, const struct pass_fill *pass, struct pen_error *error);

/* An accumulator (RGBA32F, the size of the picture), cleared to 0, for passes that add. The same one
 * for all: what it holds lasts until the next call. */
const struct gl_target *pass_sum(struct technique_run *run);

/* Draws the tiles of one class (enum tile_class) of an image of width x height pixels. */
bool pass_draw_tiles(struct technique_ctx *ctx, GLuint program, GLuint framebuffer,
    const struct gl_texture *tiles, int32_t tile_class, uint32_t width, uint32_t height, bool add,
    struct pen_error *error);

/* Methods that filter over the screen collect the faces of a light first. */
bool pass_is_first_face(const struct technique_run *run);
bool pass_is_last_face(const struct technique_run *run);
