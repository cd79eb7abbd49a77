/* FNV-1a in 64 bits: a number to tell contents apart where nobody tries to make two of them equal.
 * Begins with PEN_FNV_START; the hash of the next piece begins with that of the last. */
#pragma once
#include <stddef.h>
#include <stdint.h>

#define PEN_FNV_START 0xcbf29ce484222325u

static inline uint64_t pen_fnv(uint64_t hash, const void *data, size_t bytes)
{
    const uint8_t *at = data;
    for (size_t i = 0; i < bytes; i++)
        hash = (hash ^ at[i]) * 0x100000001b3u;
    return hash;
}
