/* Textures and framebuffers as values with a size, so that budgets can be kept. */
#pragma once
#include "renderer/gl/gl.h"
#include <stdint.h>

struct gl_texture {
    GLuint name; /* 0: none */
    GLenum target, format;
    uint32_t width, height, layers, levels;
    uint64_t bytes;
    struct gl_account *account; /* its bytes are in it; NULL: in none */
};

/* Who is charged for what is made. */
struct gl_account {
    uint64_t bytes;
    /* Called before so many more are taken; NULL: nobody is. False: they must not be, and a texture
     * of one texel is made instead. */
    bool (*make_room)(void *owner, uint64_t bytes);
    void *owner;
};
/* From now on new textures and targets are charged to *account, which outlives them; NULL: to none.
 * Returns what was there before. */
struct gl_account *gl_textures_charge(struct gl_account *account);
/* Asks whom new textures are charged to for room, as one of so many bytes does. */
bool gl_textures_make_room(uint64_t bytes);
/* Memory of the processor that belongs to what is drawn, counted as if it were a texture's until that is
 * destroyed; nobody is asked for room. */
void gl_textures_count(struct gl_texture *memory, uint64_t bytes);
/* From now on its bytes are counted elsewhere. */
void gl_texture_release_account(struct gl_texture *texture);

/* GL_TEXTURE_2D (layers 0) or GL_TEXTURE_2D_ARRAY, immutable. levels 0: the whole chain. Sampling
 * state of the texture itself: nearest, clamped; use gl_sampler for anything else. */
struct gl_texture gl_texture_create(
    GLenum format, uint32_t width, uint32_t height, uint32_t layers, uint32_t levels);
/* GL_TEXTURE_2D_MULTISAMPLE of so many samples per texel, always at the same places. */
struct gl_texture gl_texture_create_samples(
    GLenum format, uint32_t width, uint32_t height, uint32_t samples);
void gl_texture_destroy(struct gl_texture *texture);
/* As destroy, but the next one of that shape may be made of it (its texels are anything then), until
 * gl_textures_forget. */
void gl_texture_recycle(struct gl_texture *texture);
void gl_textures_forget(void);

/* Of what was deleted since gl_deleted_forget: textures, and what others add. */
void gl_deleted_add(uint64_t bytes);
uint64_t gl_deleted_bytes(void);
void gl_deleted_forget(void);

/* A framebuffer with level 0 of these as its attachments, for what gl_target does not fit: several
 * at once, or one that lasts as long as a pass. `depth` may be NULL. */
GLuint gl_framebuffer_create(
    const struct gl_texture *const *colors, uint32_t count, const struct gl_texture *depth);

enum gl_sampler_kind {
    GL_SAMPLE_NEAREST,         /* clamp */
    GL_SAMPLE_LINEAR,          /* clamp, no mips */
    GL_SAMPLE_TRILINEAR,       /* clamp, mips */
    GL_SAMPLE_NEAREST_BORDER,  /* border 1: outside a depth map nothing occludes */
    GL_SAMPLE_COMPARE_NEAREST, /* <=, border 1 */
    GL_SAMPLE_COMPARE_LINEAR,  /* <=, border 1 */
    GL_SAMPLER_KINDS
};
struct gl_samplers {
    GLuint names[GL_SAMPLER_KINDS];
};
void gl_samplers_init(struct gl_samplers *samplers);
void gl_samplers_finish(struct gl_samplers *samplers);
