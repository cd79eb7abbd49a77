#include "protocol/memory.h"
#include <stdlib.h>

static int exit_status; /* 0: abort */

void pen_memory_exit(int status)
{
    exit_status = status;
}

static void give_up(void)
{
    if (exit_status)
        _Exit(exit_status);
    abort();
}

void *pen_alloc(size_t count, size_t item_bytes)
{
    return pen_realloc_array(NULL, count, item_bytes);
}

void *pen_alloc_zero(size_t count, size_t item_bytes)
{
    void *memory = count && item_bytes ? calloc(count, item_bytes) : calloc(1, 1);
    if (!memory)
        give_up();
    return memory;
}

void *pen_realloc_array(void *memory, size_t count, size_t item_bytes)
{
    void *moved =
        count && item_bytes ? reallocarray(memory, count, item_bytes) : realloc(memory, 1);
    if (!moved)
        give_up();
    return moved;
}

void *pen_grow(void *memory, size_t *capacity, size_t count, size_t item_bytes)
{
    if (count <= *capacity)
        return memory;
    *capacity = count > 2 * *capacity ? count : 2 * *capacity;
    return pen_realloc_array(memory, *capacity, item_bytes);
}
