/* A file in memory. */
#pragma once
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct pen_bytes {
    uint8_t *data; /* freed with pen_bytes_finish */
    size_t size;
};
void pen_bytes_finish(struct pen_bytes *bytes);

/* One that is being written, for libraries that go back in it. Starts with all zeros. */
struct bytes_file {
    struct pen_bytes bytes;
    size_t capacity, at; /* at: where the next write goes; what is skipped holds zeros */
};
bool bytes_file_write(
    struct bytes_file *file, const void *data, size_t size); /* false: no memory */
