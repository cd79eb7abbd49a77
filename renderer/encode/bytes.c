#include "renderer/encode/bytes.h"
#include <stdlib.h>
#include <string.h>

#define FIRST_BYTES 65536

void pen_bytes_finish(struct pen_bytes *bytes)
{
    free(bytes->data);
    *bytes = (struct pen_bytes){0};
}

bool bytes_file_write(struct bytes_file *file, const void *data, size_t size)
{
    size_t end;
    if (__builtin_add_overflow(file->at, size, &end) || end > SIZE_MAX / 2)
        return false;
    if (end > file->capacity) {
        size_t capacity = file->capacity ? file->capacity : FIRST_BYTES;
        while (capacity < end)
            capacity *= 2;
        uint8_t *grown = realloc(file->bytes.data, capacity);
        if (!grown)
            return false;
        file->bytes.data = grown;
        file->capacity = capacity;
    }
    if (file->at > file->bytes.size)
        memset(file->bytes.data + file->bytes.size, 0, file->at - file->bytes.size);
    if (size)
        memcpy(file->bytes.data + file->at, data, size);
    file->at = end;
    if (end > file->bytes.size)
        file->bytes.size = end;
    return true;
}
