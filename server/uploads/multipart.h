/* A streaming reader of multipart/form-data (RFC 7578): pieces of a body in, parts out. */
#pragma once
#include "protocol/error.h"
#include <stddef.h>

struct multipart;
struct multipart_sink {
    /* A part that carries a file begins; `name` is its file name. */
    bool (*begin)(void *context, const char *name, struct pen_error *error);
    bool (*data)(void *context, const void *data, size_t bytes, struct pen_error *error);
    void *context;
};

/* From a Content-Type header. NULL with PEN_UNKNOWN_TYPE when there is no usable boundary. */
struct multipart *multipart_create(
    const char *content_type, const struct multipart_sink *sink, struct pen_error *error);
void multipart_destroy(struct multipart *multipart); /* NULL is fine */
/* Errors: PEN_MALFORMED, or the sink's. */
bool multipart_add(
    struct multipart *multipart, const void *data, size_t bytes, struct pen_error *error);
/* The body is over. Errors: PEN_MALFORMED when the closing boundary has not come. */
bool multipart_end(const struct multipart *multipart, struct pen_error *error);
