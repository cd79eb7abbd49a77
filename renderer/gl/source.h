/* The shader sources of renderer/shaders and renderer/techniques, embedded at build time. */
#pragma once
#include <stdbool.h>
#include <stddef.h>

/* A number that C has too: an item of an enumeration, a binding point. */
struct gl_constant {
    const char *name;
    int value;
    bool is_unsigned;
};

struct gl_source {
    const char *name;                    /* file name without folder: "pcss.glsl" */
    const char *text;                    /* NUL-terminated */
    const struct gl_constant *constants; /* go before the text, end with a NULL name; or NULL */
};
extern const struct gl_source gl_sources[]; /* ends with a NULL name */
