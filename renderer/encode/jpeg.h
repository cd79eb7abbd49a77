/* JPEG files. */
#pragma once
#include "renderer/encode/bytes.h"
#include "renderer/picture.h"

/* Writes planes[0] with 8 bits per channel, grey or colour, without alpha. `description` goes into a
 * comment; "": none. `quality`: 1 to 100. Errors: PEN_INTERNAL. */
bool jpeg_encode(const struct pen_frame *frame, uint32_t quality, const char *description,
    struct pen_bytes *bytes, struct pen_error *error);
