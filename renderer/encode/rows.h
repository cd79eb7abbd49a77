/* Where a writer gets its samples from. */
#pragma once
#include <stdint.h>

/* Asks for rows [first, first + count): interleaved samples without gaps. */
typedef void encode_rows(void *user, uint32_t first, uint32_t count, void *out);
