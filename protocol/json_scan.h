/* Strict check of JSON text before any tree is built from it. */
#pragma once
#include "protocol/error.h"
#include <stddef.h>

/* Accepts exactly RFC 8259, in UTF-8, with containers at most `max_depth` deep, numbers of at most
 * 60 characters and no NUL character in any string. Needs no memory and no recursion, whatever the
 * text. Errors: PEN_MALFORMED with the byte offset in the message. */
bool pen_json_scan(const char *text, size_t bytes, unsigned max_depth, struct pen_error *error);
