#include "server/store/quota.h"
#include "protocol/memory.h"
#include <errno.h>
#include <pthread.h>
#include <stdlib.h>

struct store_quota {
    uint64_t limit;
    pthread_mutex_t lock; /* guards what follows */
    uint64_t used, spare; /* spare: part of used */
    store_reclaim *reclaim;
    void *reclaim_context;
};

struct store_quota *store_quota_create(uint64_t limit)
{
    struct store_quota *q = pen_alloc_zero(1, sizeof *q);
    pthread_mutex_init(&q->lock, NULL);
    q->limit = limit ? limit : UINT64_MAX;
    return q;
}

void store_quota_destroy(struct store_quota *q)
{
    if (!q)
        return;
    pthread_mutex_destroy(&q->lock);
    free(q);
}

void store_quota_on_need(struct store_quota *q, store_reclaim *reclaim, void *context)
{
    pthread_mutex_lock(&q->lock);
    q->reclaim = reclaim;
    q->reclaim_context = context;
    pthread_mutex_unlock(&q->lock);
}

/* What was there at the start may be more than is allowed now. */
static uint64_t left(const struct store_quota *q)
{
    return q->limit > q->used ? q->limit - q->used : 0;
}

/* Takes them if they are there; *missing: how many are not. */
static bool take(struct store_quota *q, uint64_t bytes, uint64_t *missing)
{
    pthread_mutex_lock(&q->lock);
    bool fits = bytes <= left(q);
    *missing = fits ? 0 : bytes - left(q);
    q->used += fits ? bytes : 0;
    pthread_mutex_unlock(&q->lock);
    return fits;
}

static double mib(uint64_t bytes)
{
    return (double)bytes / (1 << 20);
}

static bool refuse(struct store_quota *q, uint64_t bytes, struct pen_error *error)
{
    return pen_fail(error, PEN_FULL, "",
        "The store holds %.1f of %.1f MiB, and %.1f MiB more are needed. Delete scenes or images "
        "that are no longer used, or have --store-limit raised.",
        mib(store_quota_used(q)), mib(q->limit), mib(bytes));
}

bool store_quota_claim(struct store_quota *q, uint64_t bytes, struct pen_error *error)
{
    uint64_t missing;
    if (take(q, bytes, &missing))
        return true;
    pthread_mutex_lock(&q->lock);
    store_reclaim *reclaim = q->reclaim;
    void *context = q->reclaim_context;
    pthread_mutex_unlock(&q->lock);
    if (reclaim) {
        reclaim(context, missing);
        if (take(q, bytes, &missing))
            return true;
    }
    return refuse(q, bytes, error);
}

bool store_quota_fits(struct store_quota *q, uint64_t bytes, struct pen_error *error)
{
    return bytes <= store_quota_left(q) || refuse(q, bytes, error);
}

void store_quota_settle(struct store_quota *q, uint64_t before, uint64_t after)
{
    pthread_mutex_lock(&q->lock);
    q->used += after;
    q->used -= before < q->used ? before : q->used;
    pthread_mutex_unlock(&q->lock);
}

void store_quota_spare(struct store_quota *q, uint64_t before, uint64_t after)
{
    pthread_mutex_lock(&q->lock);
    q->spare += after;
    q->spare -= before < q->spare ? before : q->spare;
    pthread_mutex_unlock(&q->lock);
}

uint64_t store_quota_left(struct store_quota *q)
{
    pthread_mutex_lock(&q->lock);
    uint64_t held = q->used - q->spare;
    uint64_t bytes = q->limit == UINT64_MAX ? UINT64_MAX : q->limit > held ? q->limit - held : 0;
    pthread_mutex_unlock(&q->lock);
    return bytes;
}

uint64_t store_quota_used(struct store_quota *q)
{
    pthread_mutex_lock(&q->lock);
    uint64_t used = q->used;
    pthread_mutex_unlock(&q->lock);
    return used;
}

bool store_write_failed(int code, struct pen_error *error)
{
    if (code == ENOSPC || code == EDQUOT || code == EFBIG)
        return pen_fail(error, PEN_FULL, "", "The disk that the store is on is full.");
    return pen_fail(error, PEN_UNAVAILABLE, "", "The store could not be written.");
}
