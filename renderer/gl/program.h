/* Compiled programs, kept by their full source text. */
#pragma once
#include "protocol/technique_info.h"
#include "renderer/gl/gl.h"

struct gl_programs;

/* What a program is made of: `#version`, `defines`, the parameter block of `info` (when given),
 * then the named files, in which a line `#include "name"` is replaced once by that file. */
struct gl_program_desc {
    const char *vertex, *fragment, *compute; /* file names in gl_sources; NULL: no such stage */
    const char *body;    /* replaces `#include "BODY"` in the files: a technique's own file */
    const char *defines; /* "#define A 1\n..." or NULL */
    const struct pen_technique_info *info; /* parameter rows: macro P(name), or NULL */
    const void *params; /* the method's struct: values of the rows that specialise */
};

struct gl_programs *gl_programs_create(void);
void gl_programs_destroy(struct gl_programs *programs);

/* The program, compiled on first use; owned by the cache. 0 and PEN_INTERNAL when it does not
 * compile (the log goes to stderr: clients are not shown sources). */
GLuint gl_programs_get(
    struct gl_programs *programs, const struct gl_program_desc *desc, struct pen_error *error);

/* Binding points that every program shares. */
enum gl_ubo { GL_UBO_VIEW = 0, GL_UBO_LIGHT = 1, GL_UBO_PARAMS = 2, GL_UBO_EXTRA = 3 };
