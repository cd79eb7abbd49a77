/* TIFF files. */
#pragma once
#include "renderer/encode/bytes.h"
#include "renderer/picture.h"

/* Writes planes[0], grey, RGB or RGBA with unassociated alpha, 8 or 16 `bits`, deflated.
 * `description` goes into the tag of that name; "": none. Errors: PEN_INTERNAL. */
bool tiff_encode(const struct pen_frame *frame, uint32_t bits, const char *description,
    struct pen_bytes *bytes, struct pen_error *error);
