/* Compiled programs, kept by what their text is made of. */
#pragma once
#include "protocol/result.h"
#include "protocol/technique_info.h"
#include "renderer/gl/gl.h"

/* Binding points, for shaders too. */
#define SHARED_ROWS "renderer/shared/bindings.def"
#include "renderer/shared/rows_c.h"

struct gl_programs;

/* What a program is made of: `#version`, the binding points, `defines`, the parameter block of
 * `info` (when given), then the named files, in which a line `#include "name"` is replaced once by
 * that file. */
struct gl_program_desc {
    const char *vertex, *fragment, *compute; /* file names in gl_sources; NULL: no such stage */
    const char *body;    /* replaces `#include "BODY"` in the files: a technique's own file */
    const char *defines; /* "#define A 1\n..." or NULL */
    const struct pen_technique_info *info; /* parameter rows: macro P(name), or NULL */
    const void *params; /* the method's struct: values of the rows that specialise */
};

/* Keeps at most so many programs of so many bytes from frame to frame; 0: 256 and 512 MiB. make_room
 * is called when there is one more; NULL: nobody is. */
struct gl_programs *gl_programs_create(uint32_t most, uint64_t most_bytes,
    bool (*make_room)(void *owner, uint64_t more_bytes), void *owner);
void gl_programs_destroy(struct gl_programs *programs);

/* The program, assembled and compiled on first use; owned by the cache, which keeps it at least
 * until gl_programs_end_frame. 0 and PEN_INTERNAL when it does not compile (the log goes to stderr:
 * clients are not shown sources). */
GLuint gl_programs_get(
    struct gl_programs *programs, const struct gl_program_desc *desc, struct pen_error *error);

/* The number of the frame at hand. */
uint64_t gl_programs_clock(const struct gl_programs *programs);
/* A frame is done. The least recently used programs leave until the limits hold, but never one that
 * was used since the clock stood at `since`: frames in progress hold their names. */
void gl_programs_end_frame(struct gl_programs *programs, uint64_t since);
struct pen_program_counts gl_programs_counts(const struct gl_programs *programs);

/* The file with its includes replaced, as programs have it, for code that compiles pieces of its
 * own; free() it. NULL: see gl_programs_get. */
char *gl_program_text(const char *file, struct pen_error *error);
