#include "server/uploads/places.h"
#include "protocol/memory.h"
#include <pthread.h>
#include <stdlib.h>

#define OTHERS 4 /* one of so many is for others */

struct places {
    pthread_mutex_t lock; /* guards what follows */
    uint64_t *clients;    /* of each that is taken, in any order */
    uint32_t count;
    uint32_t most;
};

struct places *places_create(uint32_t most)
{
    struct places *p = pen_alloc_zero(1, sizeof *p);
    pthread_mutex_init(&p->lock, NULL);
    p->clients = pen_alloc(most, sizeof *p->clients);
    p->most = most;
    return p;
}

void places_destroy(struct places *p)
{
    if (!p)
        return;
    pthread_mutex_destroy(&p->lock);
    free(p->clients);
    free(p);
}

bool places_take(struct places *p, uint64_t client, struct pen_error *error)
{
    pthread_mutex_lock(&p->lock);
    uint32_t held = 0;
    for (uint32_t i = 0; i < p->count; i++)
        held += p->clients[i] == client;
    bool ok = true;
    if (held >= p->most - p->most / OTHERS)
        ok = pen_fail(
            error, PEN_TOO_MANY, "", "This client already has %u uploads under way.", held);
    else if (p->count == p->most)
        ok = pen_fail(error, PEN_UNAVAILABLE, "", "Too many uploads are under way.");
    else
        p->clients[p->count++] = client;
    pthread_mutex_unlock(&p->lock);
    return ok;
}

void places_leave(struct places *p, uint64_t client)
{
    pthread_mutex_lock(&p->lock);
    uint32_t i = 0;
    while (p->clients[i] != client)
        i++;
    p->clients[i] = p->clients[--p->count];
    pthread_mutex_unlock(&p->lock);
}
