/* A file in memory. */
#pragma once
#include <stddef.h>
#include <stdint.h>

struct pen_bytes {
    uint8_t *data; /* freed with pen_bytes_finish */
    size_t size;
};
void pen_bytes_finish(struct pen_bytes *bytes);
