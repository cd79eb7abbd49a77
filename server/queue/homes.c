#include "server/queue/homes.h"
#include "protocol/memory.h"
#include "server/base/clock.h"
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

/* How long a frame waits for the worker of its session, at most; and as a share of the time that its
 * client gives it. */
#define PATIENCE_NS (1 * CLOCK_S)
#define PATIENCE_SHARE 4
#define FORGOTTEN_NS (60 * CLOCK_S) /* as in the worker */

struct home {
    uint64_t client;
    char session[PEN_NAME_BYTES];
    uint64_t last_ns;
    uint32_t worker;
};

struct homes {
    pthread_mutex_t lock; /* guards everything below */
    struct home items[HOMES_MOST];
    uint32_t count;
};

struct homes *homes_create(void)
{
    struct homes *h = pen_alloc_zero(1, sizeof *h);
    pthread_mutex_init(&h->lock, NULL);
    return h;
}

void homes_destroy(struct homes *h)
{
    if (!h)
        return;
    pthread_mutex_destroy(&h->lock);
    free(h);
}

static bool has_session(const struct render *render)
{
    /* What is measured stands for itself. */
    return render->request.delivery.session[0] && render->measure == MEASURE_PICTURE;
}

static struct home *find(struct homes *h, const struct render *render)
{
    for (uint32_t i = 0; i < h->count; i++)
        if (h->items[i].client == render->payer &&
            !strcmp(h->items[i].session, render->request.delivery.session))
            return &h->items[i];
    return NULL;
}

/* A place for another one: free, or of the session that was not used for longest. */
static struct home *make(struct homes *h)
{
    if (h->count < HOMES_MOST)
        return &h->items[h->count++];
    struct home *oldest = &h->items[0];
    for (uint32_t i = 1; i < h->count; i++)
        if (h->items[i].last_ns < oldest->last_ns)
            oldest = &h->items[i];
    return oldest;
}

void homes_take(struct homes *h, const struct render *render, uint32_t worker, uint64_t now_ns)
{
    if (!has_session(render))
        return;
    pthread_mutex_lock(&h->lock);
    struct home *home = find(h, render);
    if (!home) {
        home = make(h);
        home->client = render->payer;
        memcpy(home->session, render->request.delivery.session, sizeof home->session);
    }
    home->worker = worker;
    home->last_ns = now_ns;
    pthread_mutex_unlock(&h->lock);
}

bool homes_is_away(struct homes *h, const struct render *render, uint32_t worker, uint64_t now_ns)
{
    if (!has_session(render))
        return false;
    uint64_t share = render->last_deadline_ns > render->queued_ns
                         ? (render->last_deadline_ns - render->queued_ns) / PATIENCE_SHARE
                         : 0;
    uint64_t patience = share < PATIENCE_NS ? share : PATIENCE_NS;
    pthread_mutex_lock(&h->lock);
    const struct home *home = find(h, render);
    bool away = home && home->worker != worker && now_ns < home->last_ns + FORGOTTEN_NS &&
                now_ns < render->queued_ns + patience;
    pthread_mutex_unlock(&h->lock);
    return away;
}

void homes_forget(struct homes *h, uint32_t worker)
{
    pthread_mutex_lock(&h->lock);
    for (uint32_t i = h->count; i-- > 0;)
        if (h->items[i].worker == worker)
            h->items[i] = h->items[--h->count];
    pthread_mutex_unlock(&h->lock);
}

uint32_t homes_count(struct homes *h)
{
    pthread_mutex_lock(&h->lock);
    uint32_t count = h->count;
    pthread_mutex_unlock(&h->lock);
    return count;
}
