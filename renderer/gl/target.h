/* A texture that is drawn into, with its framebuffer: what follows the size of a picture or a
 * method's settings, and is made anew when they change. */
#pragma once
#include "renderer/gl/texture.h"

struct gl_target {
    struct gl_texture texture;
    GLuint framebuffer; /* level 0 (of an array layer 0) as its one attachment */
};

/* Makes *target be of this shape (as gl_texture_create), reusing it when it already is; zero to
 * start. True when it was made anew. */
bool gl_target_fit(struct gl_target *target, GLenum format, uint32_t width, uint32_t height,
    uint32_t layers, uint32_t levels);
/* The same of so many samples per texel. */
bool gl_target_fit_samples(
    struct gl_target *target, GLenum format, uint32_t width, uint32_t height, uint32_t samples);
void gl_target_destroy(struct gl_target *target); /* zeroed or NULL: nothing happens */

/* Aims the framebuffer at one level, and of an array at one layer, until the next call. */
void gl_target_aim(const struct gl_target *target, uint32_t level, uint32_t layer);
/* Fills what the framebuffer shows, of a colour format. */
void gl_target_clear(const struct gl_target *target, const float value[4]);

/* What all targets of the process hold. On the GL thread, as all of OpenGL. */
uint64_t gl_targets_bytes(void);
