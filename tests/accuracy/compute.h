/* Runs pieces of the renderer's GLSL on the device, on data made by hand. */
#pragma once
#include "renderer/technique.h"

struct gl_context;

/* A context and what passes need of it. False: there is no OpenGL, and the test is skipped. */
bool compute_begin(struct technique_ctx *ctx, struct gl_context **context);
void compute_end(struct technique_ctx *ctx, struct gl_context *context);

/* Runs `main_text` after the named shader files (NULL-terminated), 64 invocations per group. */
void compute_run(const char *const *files, const char *main_text, uint32_t groups);

/* A buffer with these contents (or NULL), bound. */
GLuint compute_buffer(const void *data, size_t bytes, GLenum target, GLuint binding);

double compute_random(void); /* [0, 1) */
