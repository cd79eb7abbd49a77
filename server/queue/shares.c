#include "server/queue/shares.h"
#include "protocol/memory.h"
#include <stdlib.h>

struct share {
    uint64_t client;
    uint32_t held;
};

struct shares {
    struct share *items; /* those that hold any */
    uint32_t count;
    size_t capacity;
};

struct shares *shares_create(void)
{
    return pen_alloc_zero(1, sizeof(struct shares));
}

void shares_destroy(struct shares *s)
{
    if (s)
        free(s->items);
    free(s);
}

static struct share *find(const struct shares *s, uint64_t client)
{
    for (uint32_t i = 0; i < s->count; i++)
        if (s->items[i].client == client)
            return &s->items[i];
    return NULL;
}

uint32_t shares_held(const struct shares *s, uint64_t client)
{
    const struct share *share = find(s, client);
    return share ? share->held : 0;
}

void shares_use(struct shares *s, uint64_t client)
{
    struct share *share = find(s, client);
    if (!share) {
        s->items = pen_grow(s->items, &s->capacity, s->count + 1, sizeof *s->items);
        share = &s->items[s->count++];
        *share = (struct share){.client = client};
    }
    share->held++;
}

void shares_release(struct shares *s, uint64_t client)
{
    struct share *share = find(s, client);
    if (share && --share->held == 0)
        *share = s->items[--s->count];
}
