/* What EXT_meshopt_compression and KHR_meshopt_compression unpack, beyond the library's part. */
#pragma once
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* `count` elements of `stride` bytes (a multiple of 4, at most 256). False: the stream is damaged. */
bool imp_meshopt_attributes(
    uint8_t *out, uint32_t count, uint32_t stride, const uint8_t *data, size_t bytes);
/* The filter COLOR, in place; `stride` is 4 or 8. */
void imp_meshopt_colors(uint8_t *data, uint32_t count, uint32_t stride);
