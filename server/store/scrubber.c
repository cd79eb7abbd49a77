#include "server/store/scrubber.h"
#include "protocol/memory.h"
#include "server/base/clock.h"
#include "server/store/describe.h"
#include <errno.h>
#include <pthread.h>
#include <sched.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#define FIRST_S 60           /* after a start there is enough to do */
#define REST 9               /* times as long as reading an entry took */
#define IDLE_CLASS (3 << 13) /* ioprio_set(2) */

struct scrubber {
    struct scene_store *store;
    uint64_t period_s;
    pthread_mutex_t lock; /* guards what follows */
    pthread_cond_t stopped;
    bool stopping;
    uint64_t rounds;
    pthread_t thread;
};

/* False when it is to stop. */
static bool rest(struct scrubber *s, uint64_t ns)
{
    struct timespec until;
    uint64_t end = clock_now_ns() + ns;
    until.tv_sec = (time_t)(end / 1000000000);
    until.tv_nsec = (long)(end % 1000000000);
    pthread_mutex_lock(&s->lock);
    while (!s->stopping && pthread_cond_timedwait(&s->stopped, &s->lock, &until) != ETIMEDOUT)
        ;
    bool goes_on = !s->stopping;
    pthread_mutex_unlock(&s->lock);
    return goes_on;
}

static bool round_of(struct scrubber *s, enum store_kind kind)
{
    struct store_entry entry;
    uint8_t after[PEN_ID_BYTES];
    for (bool first = true; scene_store_list(s->store, kind, first ? NULL : after, &entry, 1);
         first = false) {
        uint64_t start = clock_now_ns();
        memcpy(after, entry.id, PEN_ID_BYTES);
        scene_store_scrub(s->store, kind, entry.id);
        const struct store_now now = {0};
        free(describe_stored(s->store, kind, entry.id, &now, NULL)); /* mends what it cannot read */
        if (!rest(s, REST * (clock_now_ns() - start)))
            return false;
    }
    return true;
}

static void *run(void *argument)
{
    struct scrubber *s = argument;
    struct sched_param none = {0};
    pthread_setschedparam(pthread_self(), SCHED_IDLE, &none); /* where it may */
    syscall(SYS_ioprio_set, 1, 0, IDLE_CLASS);
    uint64_t wait_s = s->period_s < FIRST_S ? s->period_s : FIRST_S;
    while (rest(s, wait_s * 1000000000)) {
        uint64_t start = clock_now_ns(), period = s->period_s * 1000000000;
        for (int kind = 0; kind < STORE_KINDS; kind++)
            if (!round_of(s, kind))
                return NULL;
        pthread_mutex_lock(&s->lock);
        s->rounds++;
        pthread_mutex_unlock(&s->lock);
        uint64_t took = clock_now_ns() - start;
        wait_s = took < period ? (period - took) / 1000000000 : 0;
    }
    return NULL;
}

struct scrubber *scrubber_create(struct scene_store *store, uint64_t period_s)
{
    if (!period_s)
        return NULL;
    struct scrubber *s = pen_alloc_zero(1, sizeof *s);
    pthread_condattr_t monotonic;
    s->store = store;
    s->period_s = period_s;
    pthread_mutex_init(&s->lock, NULL);
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_cond_init(&s->stopped, &monotonic);
    pthread_condattr_destroy(&monotonic);
    if (pthread_create(&s->thread, NULL, run, s))
        abort();
    return s;
}

void scrubber_destroy(struct scrubber *s)
{
    if (!s)
        return;
    pthread_mutex_lock(&s->lock);
    s->stopping = true;
    pthread_cond_signal(&s->stopped);
    pthread_mutex_unlock(&s->lock);
    pthread_join(s->thread, NULL);
    pthread_cond_destroy(&s->stopped);
    pthread_mutex_destroy(&s->lock);
    free(s);
}

uint64_t scrubber_rounds(struct scrubber *s)
{
    if (!s)
        return 0;
    pthread_mutex_lock(&s->lock);
    uint64_t rounds = s->rounds;
    pthread_mutex_unlock(&s->lock);
    return rounds;
}
