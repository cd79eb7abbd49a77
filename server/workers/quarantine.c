#include "server/workers/quarantine.h"
#include "protocol/fnv.h"
#include "protocol/memory.h"
#include "server/base/clock.h"
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#define ROOM 64 /* the oldest suspect is forgotten first */
#define REQUEST_KILLS 2
#define SCENE_KILLS 4 /* of several requests: each is tried twice */

struct suspect {
    uint8_t scene[PEN_ID_BYTES];
    uint64_t kind;  /* of request */
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

/* Method and size: what a camera or a light changes is as likely to end a worker. */
static uint64_t kind_of(const struct pen_request *r)
{
    const uint32_t size[] = {r->width, r->height, r->antialias};
    return pen_fnv(pen_fnv(PEN_FNV_START, r->technique, strlen(r->technique)), size, sizeof size);
}

/* What is known of the scene; what has expired is forgotten. Under the lock. */
struct record {
    struct suspect *own; /* the request's; NULL: none */
    uint32_t kills, held;
    uint64_t last_ns; /* of the oldest */
};

static struct record look_up(
    struct quarantine *q, const uint8_t scene[PEN_ID_BYTES], uint64_t kind, uint64_t now)
{
    struct record found = {.last_ns = UINT64_MAX};
    for (int i = 0; i < ROOM; i++) {
        struct suspect *s = &q->suspects[i];
        if (s->kills && now - s->last_ns >= q->duration_ns)
            s->kills = 0;
        if (!s->kills || memcmp(s->scene, scene, PEN_ID_BYTES))
            continue;
        if (s->kind == kind)
            found.own = s;
        found.kills += s->kills;
        found.held += s->kills >= REQUEST_KILLS;
        found.last_ns = s->last_ns < found.last_ns ? s->last_ns : found.last_ns;
    }
    return found;
}

static enum quarantined judge(const struct record *r)
{
    return r->kills >= SCENE_KILLS                    ? QUARANTINE_SCENE
           : r->own && r->own->kills >= REQUEST_KILLS ? QUARANTINE_REQUEST
                                                      : QUARANTINE_NOTHING;
}

static struct suspect *find_place(struct quarantine *q)
{
    struct suspect *oldest = q->suspects;
    for (int i = 0; i < ROOM; i++) {
        struct suspect *s = &q->suspects[i];
        if (!s->kills)
            return s;
        oldest = s->last_ns < oldest->last_ns ? s : oldest;
    }
    return oldest;
}

enum quarantined quarantine_blame(struct quarantine *q, const struct pen_request *request)
{
    uint64_t kind = kind_of(request);
    pthread_mutex_lock(&q->lock);
    uint64_t now = clock_now_ns(); /* under the lock: never before an entry's time */
    struct record record = look_up(q, request->scene, kind, now);
    enum quarantined before = judge(&record);
    struct suspect *s = record.own ? record.own : find_place(q);
    if (!record.own)
        *s = (struct suspect){.kind = kind};
    memcpy(s->scene, request->scene, PEN_ID_BYTES);
    s->last_ns = now;
    s->kills++;
    record = look_up(q, request->scene, kind, now);
    enum quarantined after = judge(&record);
    pthread_mutex_unlock(&q->lock);
    return after == before ? QUARANTINE_NOTHING : after;
}

enum quarantined quarantine_check(
    struct quarantine *q, const struct pen_request *request, uint32_t *remaining_s)
{
    pthread_mutex_lock(&q->lock);
    uint64_t now = clock_now_ns();
    struct record record = look_up(q, request->scene, kind_of(request), now);
    enum quarantined refused = judge(&record);
    uint64_t since = refused == QUARANTINE_SCENE ? record.last_ns
                     : refused                   ? record.own->last_ns
                                                 : now - q->duration_ns;
    pthread_mutex_unlock(&q->lock);
    *remaining_s = (uint32_t)((q->duration_ns - (now - since) + CLOCK_S - 1) / CLOCK_S);
    return refused;
}

uint32_t quarantine_count(struct quarantine *q)
{
    uint32_t count = 0;
    pthread_mutex_lock(&q->lock);
    uint64_t now = clock_now_ns();
    for (int i = 0; i < ROOM; i++) {
        const struct suspect *s = &q->suspects[i];
        if (!s->kills)
            continue;
        bool first = true;
        for (int k = 0; k < i; k++)
            first &= !q->suspects[k].kills || memcmp(q->suspects[k].scene, s->scene, PEN_ID_BYTES);
        struct record record = look_up(q, s->scene, s->kind, now);
        count += first && (record.held || record.kills >= SCENE_KILLS);
    }
    pthread_mutex_unlock(&q->lock);
    return count;
}
