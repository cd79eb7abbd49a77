/* Content-Encoding: gzip (RFC 1952), undone as it comes. */
#pragma once
#include "protocol/error.h"
#include <stddef.h>

struct gunzip;
struct gunzip *gunzip_create(void);
void gunzip_destroy(struct gunzip *gunzip);
/* Gives what the bytes hold to `take`, in pieces; false when that refuses, whose error it is, or
 * they are no gzip. Errors: PEN_MALFORMED. */
bool gunzip_add(struct gunzip *gunzip, const void *data, size_t bytes,
    bool (*take)(void *context, const void *data, size_t bytes, struct pen_error *error),
    void *context, struct pen_error *error);
/* Whether all of it has come, and its checksum was right. Errors: PEN_MALFORMED. */
bool gunzip_end(const struct gunzip *gunzip, struct pen_error *error);
