/* Allocation of the importer: never NULL, zeroed; the process ends when memory does (its limit is a
 * resource limit of the sandbox, and the front end then answers for it). */
#pragma once
#include <stdlib.h>

static inline void *imp_alloc(size_t count, size_t item_bytes)
{
    void *p = calloc(count ? count : 1, item_bytes ? item_bytes : 1);
    if (!p)
        abort();
    return p;
}

static inline void *imp_realloc(void *memory, size_t count, size_t item_bytes)
{
    void *p = reallocarray(memory, count ? count : 1, item_bytes);
    if (!p)
        abort();
    return p;
}
