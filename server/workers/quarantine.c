#include "server/workers/quarantine.h"
#include "protocol/memory.h"
#include "server/base/clock.h"
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#define ROOM 64 /* the oldest suspect is forgotten first */
#define KILLS 2

struct suspect {
    uint8_t scene[PEN_ID_BYTES];
    uint32_t kills; /* 0: the place is free */
    uint64_t last_ns;
};

struct quarantine {
    pthread_mutex_t lock; /* guards suspects */
    struct suspect suspects[ROOM];
    uint64_t duration_ns;
};

struct quarantine *quarantine_create(uint64_t seconds)
{
    struct quarantine *q = pen_alloc_zero(1, sizeof *q);
    pthread_mutex_init(&q->lock, NULL);
    q->duration_ns = seconds * CLOCK_S;
    return q;
}

void quarantine_destroy(struct quarantine *q)
{
    if (!q)
        return;
    pthread_mutex_destroy(&q->lock);
    free(q);
}

/* Forgets what has expired; returns the scene's entry or NULL. Under the lock. */
static struct suspect *find(struct quarantine *q, const uint8_t scene[PEN_ID_BYTES], uint64_t now)
{
    struct suspect *found = NULL;
    for (int i = 0; i < ROOM; i++) {
        struct suspect *s = &q->suspects[i];
        if (s->kills && now - s->last_ns >= q->duration_ns)
            s->kills = 0;
        if (s->kills && !memcmp(s->scene, scene, PEN_ID_BYTES))
            found = s;
    }
    return found;
}

bool quarantine_blame(struct quarantine *q, const uint8_t scene[PEN_ID_BYTES])
{
    pthread_mutex_lock(&q->lock);
    uint64_t now = clock_now_ns(); /* under the lock: never before an entry's time */
    struct suspect *s = find(q, scene, now);
    for (int i = 0; !s && i < ROOM; i++)
        if (!q->suspects[i].kills)
            s = &q->suspects[i];
    if (!s) {
        s = q->suspects;
        for (int i = 1; i < ROOM; i++)
            if (q->suspects[i].last_ns < s->last_ns)
                s = &q->suspects[i];
        s->kills = 0;
    }
    memcpy(s->scene, scene, PEN_ID_BYTES);
    s->last_ns = now;
    bool reached = ++s->kills == KILLS;
    pthread_mutex_unlock(&q->lock);
    return reached;
}

uint32_t quarantine_remaining_s(struct quarantine *q, const uint8_t scene[PEN_ID_BYTES])
{
    pthread_mutex_lock(&q->lock);
    uint64_t now = clock_now_ns(); /* under the lock: never before an entry's time */
    const struct suspect *s = find(q, scene, now);
    uint64_t left = s && s->kills >= KILLS ? q->duration_ns - (now - s->last_ns) : 0;
    pthread_mutex_unlock(&q->lock);
    return (uint32_t)((left + CLOCK_S - 1) / CLOCK_S);
}

uint32_t quarantine_count(struct quarantine *q)
{
    uint32_t count = 0;
    pthread_mutex_lock(&q->lock);
    uint64_t now = clock_now_ns();
    for (int i = 0; i < ROOM; i++)
        count += q->suspects[i].kills >= KILLS && now - q->suspects[i].last_ns < q->duration_ns;
    pthread_mutex_unlock(&q->lock);
    return count;
}
