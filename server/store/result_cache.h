/* Encoded images in memory, by tag, least recently used first out, under a byte budget. */
#pragma once
#include "server/store/picture.h"

struct result_cache;
struct result_cache *result_cache_create(uint64_t budget_bytes); /* 0: keeps nothing */
void result_cache_destroy(struct result_cache *cache);
/* A new reference, or NULL. */
struct picture *result_cache_get(struct result_cache *cache, const char *tag);
/* Keeps a reference of its own; false when it does not fit the budget at all. */
bool result_cache_put(struct result_cache *cache, struct picture *picture);

struct result_cache_numbers {
    uint32_t count;
    uint64_t bytes, hits, misses, evictions;
};
void result_cache_read(struct result_cache *cache, struct result_cache_numbers *numbers);
