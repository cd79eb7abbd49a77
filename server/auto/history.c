#include "server/auto/history.h"
#include "protocol/memory.h"
#include "server/base/clock.h"
#include "server/base/hash.h"
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#define ENTRIES 128
#define FORGET_NS (600 * CLOCK_S) /* a busy hour must not be held against a row for ever */

struct entry {
    uint8_t key[PEN_ID_BYTES];
    uint64_t last_ns; /* 0: free */
    struct auto_observed observed;
};

struct auto_history {
    pthread_mutex_t lock; /* guards the entries */
    struct entry entries[ENTRIES];
};

struct auto_history *auto_history_create(void)
{
    struct auto_history *history = pen_alloc_zero(1, sizeof *history);
    pthread_mutex_init(&history->lock, NULL);
    return history;
}

void auto_history_destroy(struct auto_history *history)
{
    if (!history)
        return;
    pthread_mutex_destroy(&history->lock);
    free(history);
}

void auto_history_name(const uint8_t cost[PEN_ID_BYTES], const char *key, uint32_t width,
    uint32_t height, struct auto_expected *expected)
{
    const uint32_t size[2] = {width, height};
    for (int all = 0; all < 2; all++) {
        struct hash *hash = hash_create();
        hash_add(hash, cost, PEN_ID_BYTES);
        hash_add(hash, size, sizeof size);
        if (!all)
            hash_add(hash, key, strlen(key));
        hash_finish(hash, all ? expected->all : expected->row);
    }
}

/* NULL: nothing is known, or only what is out of date. */
static struct entry *find(struct auto_history *history, const uint8_t key[PEN_ID_BYTES])
{
    for (int i = 0; i < ENTRIES; i++) {
        struct entry *e = &history->entries[i];
        if (e->last_ns && !memcmp(e->key, key, PEN_ID_BYTES))
            return clock_now_ns() - e->last_ns < FORGET_NS ? e : NULL;
    }
    return NULL;
}

static void add(
    struct auto_history *history, const uint8_t key[PEN_ID_BYTES], double expected_ms, double ms)
{
    struct entry *e = find(history, key);
    if (!e) { /* its own that is out of date, a free one, or the oldest */
        e = &history->entries[0];
        for (int i = 0; i < ENTRIES; i++) {
            struct entry *other = &history->entries[i];
            bool own = !memcmp(other->key, key, PEN_ID_BYTES);
            if (own || other->last_ns < e->last_ns)
                e = other;
            if (own)
                break;
        }
        memset(e, 0, sizeof *e);
        memcpy(e->key, key, PEN_ID_BYTES);
    }
    e->last_ns = clock_now_ns();
    auto_observe(&e->observed, expected_ms, ms);
}

void auto_history_add(struct auto_history *history, const struct auto_expected *expected, double ms)
{
    pthread_mutex_lock(&history->lock);
    add(history, expected->row, expected->ms, ms);
    add(history, expected->all, expected->ms, ms);
    pthread_mutex_unlock(&history->lock);
}

double auto_history_factor(struct auto_history *history, const struct auto_expected *expected)
{
    static const struct auto_observed nothing;
    pthread_mutex_lock(&history->lock);
    const struct entry *row = find(history, expected->row), *all = find(history, expected->all);
    double factor =
        auto_correction(row ? &row->observed : &nothing, all ? &all->observed : &nothing);
    pthread_mutex_unlock(&history->lock);
    return factor;
}
