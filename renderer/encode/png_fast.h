/* A PNG writer for pictures that are wanted now: one filter, one fast deflate pass. */
#pragma once
#include "renderer/encode/bytes.h"
#include "renderer/picture.h"

/* Writes planes[0] as 8 or 16 bits per channel. Errors: PEN_INTERNAL. */
bool png_fast_encode(const struct pen_frame *frame, uint32_t bit_depth,
    const char *const *attributes, uint32_t attribute_count, struct pen_bytes *bytes,
    struct pen_error *error);
