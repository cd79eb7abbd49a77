#include "server/live/feed.h"
#include "protocol/memory.h"
#include <errno.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define RETRY_MS 2000 /* until a client that lost the connection comes again */

struct listener {
    struct listener *next;
    struct feed *feed;
    struct http_exchange *exchange;
    uint64_t seen; /* number of the last event that it was given */
    bool asleep;   /* guarded by the feed's lock, which is held while http.h is called */
    char *text;    /* being sent; the sending thread's */
    size_t bytes, at;
    bool greeted, over;
};

struct feed {
    const char *event;
    uint32_t interval_ms;
    char *(*make)(void *context);
    void *context;
    pthread_t thread;
    pthread_mutex_t lock; /* guards what follows */
    pthread_cond_t change;
    struct listener *listeners;
    char *data;
    uint64_t number; /* of data; 0: there is none */
    bool closing;
};

/* With the lock held. */
static void wake_all(struct feed *feed)
{
    for (struct listener *l = feed->listeners; l; l = l->next)
        if (l->asleep) {
            l->asleep = false;
            http_wake(l->exchange);
        }
}

static void wait_until(struct feed *feed, const struct timespec *end)
{
    while (!feed->closing && pthread_cond_timedwait(&feed->change, &feed->lock, end) != ETIMEDOUT)
        ;
}

static void *run(void *argument)
{
    struct feed *feed = argument;
    struct timespec due;
    pthread_mutex_lock(&feed->lock);
    while (!feed->closing) {
        if (!feed->listeners) {
            pthread_cond_wait(&feed->change, &feed->lock);
            continue;
        }
        clock_gettime(CLOCK_MONOTONIC, &due);
        pthread_mutex_unlock(&feed->lock);
        char *data = feed->make(feed->context);
        pthread_mutex_lock(&feed->lock);
        free(feed->data);
        feed->data = data;
        feed->number++;
        wake_all(feed);
        due.tv_nsec += feed->interval_ms % 1000 * 1000000L;
        due.tv_sec += feed->interval_ms / 1000 + due.tv_nsec / 1000000000;
        due.tv_nsec %= 1000000000;
        wait_until(feed, &due);
    }
    pthread_mutex_unlock(&feed->lock);
    return NULL;
}

struct feed *feed_create(
    const char *event, uint32_t interval_ms, char *(*make)(void *context), void *context)
{
    struct feed *feed = pen_alloc_zero(1, sizeof *feed);
    pthread_condattr_t clock;
    feed->event = event;
    feed->interval_ms = interval_ms;
    feed->make = make;
    feed->context = context;
    pthread_mutex_init(&feed->lock, NULL);
    pthread_condattr_init(&clock);
    pthread_condattr_setclock(&clock, CLOCK_MONOTONIC);
    pthread_cond_init(&feed->change, &clock);
    pthread_condattr_destroy(&clock);
    if (pthread_create(&feed->thread, NULL, run, feed))
        abort();
    return feed;
}

void feed_close(struct feed *feed)
{
    if (!feed)
        return;
    pthread_mutex_lock(&feed->lock);
    bool first = !feed->closing;
    feed->closing = true;
    wake_all(feed);
    pthread_cond_broadcast(&feed->change);
    pthread_mutex_unlock(&feed->lock);
    if (first)
        pthread_join(feed->thread, NULL);
}

void feed_destroy(struct feed *feed)
{
    if (!feed)
        return;
    feed_close(feed);
    pthread_cond_destroy(&feed->change);
    pthread_mutex_destroy(&feed->lock);
    free(feed->data);
    free(feed);
}

static void release(void *owner)
{
    struct listener *l = owner;
    struct feed *feed = l->feed;
    pthread_mutex_lock(&feed->lock);
    struct listener **at = &feed->listeners;
    while (*at != l)
        at = &(*at)->next;
    *at = l->next;
    pthread_mutex_unlock(&feed->lock);
    free(l->text);
    free(l);
}

/* Takes the newest event, if that is new to the listener; else it sleeps: false. */
static bool take(struct listener *l)
{
    struct feed *feed = l->feed;
    free(l->text);
    l->text = NULL;
    l->bytes = l->at = 0;
    pthread_mutex_lock(&feed->lock);
    l->over = feed->closing;
    bool news = feed->number > l->seen;
    if (news && !l->over) {
        char retry[32] = "";
        if (!l->greeted)
            snprintf(retry, sizeof retry, "retry: %d\n", RETRY_MS);
        int bytes = asprintf(&l->text, "%sevent: %s\ndata: %s\n\n", retry, feed->event, feed->data);
        l->bytes = bytes < 0 ? 0 : (size_t)bytes;
        l->seen = feed->number;
        l->greeted = true;
    } else if (!l->over) {
        l->asleep = true;
        http_sleep(l->exchange);
    }
    pthread_mutex_unlock(&feed->lock);
    return l->over || news;
}

static int64_t read_feed(void *owner, void *to, size_t most)
{
    struct listener *l = owner;
    while (l->at == l->bytes) {
        if (l->over)
            return HTTP_STREAM_OVER;
        if (!take(l))
            return 0;
    }
    size_t bytes = l->bytes - l->at < most ? l->bytes - l->at : most;
    memcpy(to, l->text + l->at, bytes);
    l->at += bytes;
    return (int64_t)bytes;
}

void feed_answer(struct feed *feed, struct http_exchange *exchange)
{
    struct listener *l = pen_alloc_zero(1, sizeof *l);
    l->feed = feed;
    l->exchange = exchange;
    pthread_mutex_lock(&feed->lock);
    bool first = !feed->listeners;
    l->seen = first ? feed->number : 0; /* what is left from earlier is old */
    l->next = feed->listeners;
    feed->listeners = l;
    pthread_cond_broadcast(&feed->change);
    pthread_mutex_unlock(&feed->lock);
    http_add_header(exchange, "Cache-Control", "no-store, no-transform");
    http_add_header(exchange, "X-Accel-Buffering", "no"); /* proxies pass each event on at once */
    http_answer_stream(exchange, 200, "text/event-stream",
        (struct http_stream){.read = read_feed, .release = release, .owner = l});
}
