/* WebP files. */
#pragma once
#include "renderer/encode/bytes.h"
#include "renderer/picture.h"

/* Writes planes[0] with 8 bits per channel, lossless at quality 100. Errors: PEN_INTERNAL. */
bool webp_encode(const struct pen_frame *frame, uint32_t quality, struct pen_bytes *bytes,
    struct pen_error *error);
