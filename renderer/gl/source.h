/* The shader sources of renderer/shaders and renderer/techniques, embedded at build time. */
#pragma once
#include <stddef.h>

struct gl_source {
    const char *name; /* file name without folder: "pcss.glsl" */
    const char *text; /* NUL-terminated */
};
extern const struct gl_source gl_sources[]; /* ends with a NULL name */
