#include "server/store/result_cache.h"
#include "protocol/memory.h"
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#define BUCKETS 1024

struct entry {
    struct entry *chain;         /* same bucket */
    struct entry *newer, *older; /* in order of use */
    struct picture *picture;
};

struct result_cache {
    pthread_mutex_t lock; /* guards everything below */
    struct entry *buckets[BUCKETS];
    struct entry *newest, *oldest;
    struct result_cache_numbers numbers;
    uint64_t budget; /* constant */
};

struct result_cache *result_cache_create(uint64_t budget_bytes)
{
    struct result_cache *cache = pen_alloc_zero(1, sizeof *cache);
    pthread_mutex_init(&cache->lock, NULL);
    cache->budget = budget_bytes;
    return cache;
}

/* The tag is a hash already: four of its digits choose the bucket. */
static struct entry **bucket(struct result_cache *cache, const char *tag)
{
    char digits[5] = {tag[0], tag[1], tag[2], tag[3], 0};
    return &cache->buckets[strtoul(digits, NULL, 16) % BUCKETS];
}

static struct entry *find(struct result_cache *cache, const char *tag)
{
    for (struct entry *e = *bucket(cache, tag); e; e = e->chain)
        if (!strcmp(e->picture->tag, tag))
            return e;
    return NULL;
}

static void unlink_use(struct result_cache *cache, struct entry *e)
{
    *(e->newer ? &e->newer->older : &cache->newest) = e->older;
    *(e->older ? &e->older->newer : &cache->oldest) = e->newer;
}

static void link_newest(struct result_cache *cache, struct entry *e)
{
    e->newer = NULL;
    e->older = cache->newest;
    *(e->older ? &e->older->newer : &cache->oldest) = e;
    cache->newest = e;
}

/* Takes the entry out; the caller releases its picture and frees it. */
static void take_out(struct result_cache *cache, struct entry *e)
{
    struct entry **at = bucket(cache, e->picture->tag);
    while (*at != e)
        at = &(*at)->chain;
    *at = e->chain;
    unlink_use(cache, e);
    cache->numbers.count--;
    cache->numbers.bytes -= picture_cost(e->picture);
}

struct picture *result_cache_get(struct result_cache *cache, const char *tag)
{
    struct picture *picture = NULL;
    pthread_mutex_lock(&cache->lock);
    struct entry *e = find(cache, tag);
    if (e) {
        unlink_use(cache, e);
        link_newest(cache, e);
        picture = picture_reference(e->picture);
        cache->numbers.hits++;
    } else {
        cache->numbers.misses++;
    }
    pthread_mutex_unlock(&cache->lock);
    return picture;
}

static void free_chain(struct entry *list)
{
    while (list) {
        struct entry *next = list->chain;
        picture_release(list->picture);
        free(list);
        list = next;
    }
}

bool result_cache_put(struct result_cache *cache, struct picture *picture)
{
    size_t cost = picture_cost(picture);
    struct entry *gone = NULL;
    if (cost > cache->budget)
        return false;
    struct entry *fresh = pen_alloc_zero(1, sizeof *fresh);
    pthread_mutex_lock(&cache->lock);
    struct entry *same = find(cache, picture->tag);
    if (same) {
        take_out(cache, same);
        same->chain = gone;
        gone = same;
    }
    while (cache->oldest && cache->numbers.bytes + cost > cache->budget) {
        struct entry *e = cache->oldest;
        take_out(cache, e);
        e->chain = gone;
        gone = e;
        cache->numbers.evictions++;
    }
    fresh->picture = picture_reference(picture);
    struct entry **at = bucket(cache, picture->tag);
    fresh->chain = *at;
    *at = fresh;
    link_newest(cache, fresh);
    cache->numbers.count++;
    cache->numbers.bytes += cost;
    pthread_mutex_unlock(&cache->lock);
    free_chain(gone); /* unmaps: not under the lock */
    return true;
}

void result_cache_destroy(struct result_cache *cache)
{
    if (!cache)
        return;
    for (int b = 0; b < BUCKETS; b++)
        free_chain(cache->buckets[b]);
    pthread_mutex_destroy(&cache->lock);
    free(cache);
}

void result_cache_read(struct result_cache *cache, struct result_cache_numbers *numbers)
{
    pthread_mutex_lock(&cache->lock);
    *numbers = cache->numbers;
    pthread_mutex_unlock(&cache->lock);
}
