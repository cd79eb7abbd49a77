#include "protocol/memory.h"
#include <stdlib.h>

void *pen_alloc(size_t count, size_t item_bytes)
{
    return pen_realloc_array(NULL, count, item_bytes);
}

void *pen_alloc_zero(size_t count, size_t item_bytes)
{
    void *memory = count && item_bytes ? calloc(count, item_bytes) : calloc(1, 1);
    if (!memory)
        abort();
    return memory;
}

void *pen_realloc_array(void *memory, size_t count, size_t item_bytes)
{
    void *moved =
        count && item_bytes ? reallocarray(memory, count, item_bytes) : realloc(memory, 1);
    if (!moved)
        abort();
    return moved;
}

void *pen_grow(void *memory, size_t *capacity, size_t count, size_t item_bytes)
{
    if (count <= *capacity)
        return memory;
    *capacity = count > 2 * *capacity ? count : 2 * *capacity;
    return pen_realloc_array(memory, *capacity, item_bytes);
}
