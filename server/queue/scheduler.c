#include "server/queue/scheduler.h"
#include "protocol/memory.h"
#include "server/base/clock.h"
#include <fcntl.h>
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define BATCH_TURN 8 /* every eighth render may be a batch one, so that batches never starve */

/* After the deadline, for a worker to finish what it has and to encode it. */
#define BEST_GRACE_NS (20 * CLOCK_S)

struct share {
    uint64_t client;
    uint32_t used;
};

struct scheduler {
    pthread_mutex_t lock;       /* guards everything below, and the waiters of every render */
    struct render *queue[2][2]; /* [batch][first, last] */
    struct render *running;
    struct share *shares;
    uint32_t share_count;
    size_t share_capacity;
    uint64_t next_id;
    uint32_t turn;
    double mean_ms; /* of a render on a worker, decaying */
    struct scheduler_numbers numbers;
    /* Constant after creation. */
    struct scheduler_limits limits;
    void (*on_work)(void *);
    void *context;
};

struct scheduler *scheduler_create(
    const struct scheduler_limits *limits, void (*on_work)(void *context), void *context)
{
    struct scheduler *s = pen_alloc_zero(1, sizeof *s);
    pthread_mutex_init(&s->lock, NULL);
    s->limits = *limits;
    s->on_work = on_work;
    s->context = context;
    s->mean_ms = 50;
    return s;
}

void scheduler_destroy(struct scheduler *s)
{
    if (!s)
        return;
    pthread_mutex_destroy(&s->lock);
    free(s->shares);
    free(s);
}

static uint32_t retry_after(const struct scheduler *s)
{
    double seconds = s->mean_ms * (s->numbers.queued + 1) / fmax(1, s->limits.workers) / 1e3;
    return (uint32_t)fmin(60, fmax(1, ceil(seconds)));
}

static struct share *find_share(struct scheduler *s, uint64_t client)
{
    for (uint32_t i = 0; i < s->share_count; i++)
        if (s->shares[i].client == client)
            return &s->shares[i];
    return NULL;
}

static void use_share(struct scheduler *s, uint64_t client)
{
    struct share *share = find_share(s, client);
    if (!share) {
        s->shares = pen_grow(s->shares, &s->share_capacity, s->share_count + 1, sizeof *s->shares);
        share = &s->shares[s->share_count++];
        *share = (struct share){.client = client};
    }
    share->used++;
}

void scheduler_release(struct scheduler *s, uint64_t client)
{
    if (!client)
        return;
    pthread_mutex_lock(&s->lock);
    struct share *share = find_share(s, client);
    if (share && --share->used == 0)
        *share = s->shares[--s->share_count];
    pthread_mutex_unlock(&s->lock);
}

static void push_back(struct scheduler *s, struct render *render)
{
    struct render **queue = s->queue[render->batch];
    render->next = NULL;
    if (queue[1])
        queue[1]->next = render;
    else
        queue[0] = render;
    queue[1] = render;
    s->numbers.queued++;
}

static void push_front(struct scheduler *s, struct render *render)
{
    struct render **queue = s->queue[render->batch];
    render->next = queue[0];
    queue[0] = render;
    if (!queue[1])
        queue[1] = render;
    s->numbers.queued++;
}

static void unlink_queued(struct scheduler *s, struct render *render)
{
    struct render **queue = s->queue[render->batch], *before = NULL;
    for (struct render *at = queue[0]; at != render; at = at->next)
        before = at;
    if (before)
        before->next = render->next;
    else
        queue[0] = render->next;
    if (queue[1] == render)
        queue[1] = before;
    s->numbers.queued--;
}

static void unlink_running(struct scheduler *s, struct render *render)
{
    struct render **at = &s->running;
    while (*at != render)
        at = &(*at)->next;
    *at = render->next;
    s->numbers.running--;
}

static void free_render(struct render *render)
{
    if (render && render->reference_fd > 0)
        close(render->reference_fd);
    free(render);
}

static struct render *find_key(struct scheduler *s, const uint8_t key[PEN_ID_BYTES])
{
    struct render *lists[] = {s->queue[0][0], s->queue[1][0], s->running};
    for (int l = 0; l < 3; l++)
        for (struct render *r = lists[l]; r; r = r->next)
            if (r->shareable && !memcmp(r->key, key, PEN_ID_BYTES))
                return r;
    return NULL;
}

static void attach(struct scheduler *s, struct render *render, struct waiter *waiter)
{
    waiter->next = render->waiters;
    render->waiters = waiter;
    if (waiter->deadline_ns > render->last_deadline_ns)
        render->last_deadline_ns = waiter->deadline_ns;
    s->numbers.waiting++;
}

bool scheduler_submit(struct scheduler *s, const struct pen_request *request,
    const uint8_t key[PEN_ID_BYTES], bool shareable, struct waiter *waiter, struct pen_error *error)
{
    bool batch = request->delivery.priority == PEN_PRIORITY_BATCH;
    struct render *fresh = pen_alloc_zero(1, sizeof *fresh);
    pthread_mutex_lock(&s->lock);
    struct share *share = find_share(s, waiter->client);
    struct render *render = shareable ? find_key(s, key) : NULL;
    if (s->numbers.draining) {
        pen_fail(error, PEN_UNAVAILABLE, "", "The service is shutting down.");
    } else if (waiter->client && s->limits.client_share && share &&
               share->used >= s->limits.client_share) {
        s->numbers.refused_share++;
        pen_fail(
            error, PEN_TOO_MANY, "", "This client already has %u renders under way.", share->used);
    } else if (!render && s->numbers.queued >= s->limits.queue) {
        s->numbers.refused_full++;
        pen_fail(error, PEN_UNAVAILABLE, "", "The queue is full.");
    } else {
        if (waiter->client)
            use_share(s, waiter->client);
        if (render) {
            s->numbers.shared++;
            if (!batch && render->batch && !render->running) {
                unlink_queued(s, render);
                render->batch = false;
                push_back(s, render);
            }
        } else {
            render = fresh;
            fresh = NULL;
            render->id = ++s->next_id;
            render->request = *request;
            render->shareable = shareable;
            render->batch = batch;
            render->queued_ns = clock_now_ns();
            memcpy(render->key, key, PEN_ID_BYTES);
            render->measure = waiter->measure;
            render->client = waiter->client;
            render->best_until_ns = waiter->best ? waiter->deadline_ns : 0;
            if (waiter->reference_fd > 0)
                render->reference_fd = fcntl(waiter->reference_fd, F_DUPFD_CLOEXEC, 3);
            push_back(s, render);
        }
        attach(s, render, waiter);
        render = NULL;
        error = NULL;
    }
    if (error)
        error->retry_after_s = retry_after(s);
    pthread_mutex_unlock(&s->lock);
    free(fresh);
    if (!error)
        s->on_work(s->context);
    return !error;
}

static void answer_all(struct waiter *list, const struct outcome *outcome)
{
    while (list) {
        struct waiter *waiter = list;
        list = waiter->next;
        waiter->finish(waiter, outcome); /* may free it */
    }
}

/* Of a detached list, keeps those whose client is still there and answers the others (an answer
 * that nobody reads, but it frees the connection). Called without the lock. */
static struct waiter *sift(struct waiter *list, uint32_t *gone_count)
{
    struct waiter *kept = NULL, *gone = NULL;
    *gone_count = 0;
    while (list) {
        struct waiter *waiter = list, **to = &kept;
        list = waiter->next;
        if (waiter->is_gone && waiter->is_gone(waiter)) {
            to = &gone;
            ++*gone_count;
        }
        waiter->next = *to;
        *to = waiter;
    }
    struct outcome outcome = {0};
    pen_fail(&outcome.error, PEN_TIMEOUT, "", "The client hung up.");
    answer_all(gone, &outcome);
    return kept;
}

#define MOST_BARRED 16

/* Scenes of which an older render waits. */
struct barred {
    uint32_t count;
    const uint8_t *scenes[MOST_BARRED];
};

static bool is_barred(const struct barred *barred, const struct render *render)
{
    for (uint32_t i = 0; i < barred->count; i++)
        if (!memcmp(barred->scenes[i], render->request.scene, PEN_ID_BYTES))
            return true;
    return false;
}

/* The first of a queue that fits; NULL: none. *nothing: nor may any other be taken. */
static struct render *first_fit(
    const struct scheduler *s, bool batch, const struct taker *taker, bool *nothing)
{
    struct barred barred = {0};
    struct render *render = s->queue[batch][0];
    for (; render; render = render->next) {
        if (is_barred(&barred, render))
            continue;
        enum take take = taker->fits(taker->context, render);
        if (take == TAKE_FITS)
            break;
        *nothing |= take == TAKE_NOTHING;
        if (*nothing)
            return NULL;
        if (take == TAKE_SCENE_LATER && barred.count < MOST_BARRED)
            barred.scenes[barred.count++] = render->request.scene;
    }
    return render;
}

/* Of a render that runs, answers the waiters whose clients are gone. True when others are left. */
static bool keep_wanted(struct scheduler *s, struct render *render)
{
    struct waiter *waiters = render->waiters;
    render->waiters = NULL; /* while they are looked at, nobody else may answer them */
    pthread_mutex_unlock(&s->lock);
    uint32_t gone;
    waiters = sift(waiters, &gone);
    pthread_mutex_lock(&s->lock);
    s->numbers.abandoned += gone;
    s->numbers.waiting -= gone;
    while (waiters) {
        struct waiter *waiter = waiters;
        waiters = waiter->next;
        waiter->next = render->waiters;
        render->waiters = waiter;
    }
    return render->waiters != NULL;
}

/* Those before it that did not fit have been passed. */
static void count_passed(struct scheduler *s, const struct render *taken)
{
    for (struct render *r = s->queue[taken->batch][0]; r != taken; r = r->next)
        r->passed++;
}

struct render *scheduler_take(struct scheduler *s, const struct taker *taker)
{
    for (;;) {
        pthread_mutex_lock(&s->lock);
        bool nothing = false;
        struct render *interactive = first_fit(s, false, taker, &nothing);
        struct render *batch = nothing ? NULL : first_fit(s, true, taker, &nothing);
        bool turn = s->turn % BATCH_TURN == BATCH_TURN - 1;
        struct render *render = batch && (!interactive || turn) ? batch : interactive;
        if (!render) {
            pthread_mutex_unlock(&s->lock);
            return NULL;
        }
        s->turn++;
        count_passed(s, render);
        unlink_queued(s, render);
        render->running = true;
        render->taken_ns = clock_now_ns();
        render->next = s->running;
        s->running = render;
        s->numbers.running++;
        bool wanted = keep_wanted(s, render);
        if (!wanted)
            unlink_running(s, render);
        pthread_mutex_unlock(&s->lock);
        if (wanted)
            return render;
        free_render(render);
    }
}

bool scheduler_is_wanted(struct scheduler *s, struct render *render)
{
    pthread_mutex_lock(&s->lock);
    bool wanted = keep_wanted(s, render);
    if (!wanted)
        render->shareable = false;
    pthread_mutex_unlock(&s->lock);
    return wanted;
}

void scheduler_return(struct scheduler *s, struct render *render)
{
    pthread_mutex_lock(&s->lock);
    unlink_running(s, render);
    render->running = false;
    bool wanted = render->waiters != NULL;
    if (wanted)
        push_front(s, render);
    pthread_mutex_unlock(&s->lock);
    if (wanted)
        s->on_work(s->context);
    else
        free_render(render);
}

void scheduler_finish(struct scheduler *s, struct render *render, const struct outcome *outcome)
{
    struct outcome answer = *outcome;
    pthread_mutex_lock(&s->lock);
    unlink_running(s, render);
    struct waiter *waiters = render->waiters;
    uint32_t count = 0;
    for (struct waiter *w = waiters; w; w = w->next)
        count++;
    s->numbers.waiting -= count;
    double ms = clock_ms(clock_now_ns() - render->taken_ns);
    if (answer.error.code == PEN_OK)
        s->mean_ms += 0.1 * (ms - s->mean_ms);
    if (answer.error.code != PEN_OK)
        answer.error.retry_after_s = retry_after(s);
    pthread_mutex_unlock(&s->lock);
    answer.run_ms = ms;
    answer.queue_ms = clock_ms(render->taken_ns - render->queued_ns);
    answer.shared = count > 1;
    answer_all(waiters, &answer);
    free_render(render);
}

/* Moves the waiters that `now` has overtaken (UINT64_MAX: all of them) to *out. */
static uint64_t collect(struct scheduler *s, struct render *list, uint64_t now, struct waiter **out)
{
    uint64_t next = UINT64_MAX;
    for (struct render *r = list; r; r = r->next) {
        struct waiter **at = &r->waiters;
        while (*at) {
            struct waiter *waiter = *at;
            uint64_t deadline =
                waiter->deadline_ns + (waiter->best && r->running ? BEST_GRACE_NS : 0);
            if (deadline > now) {
                next = deadline < next ? deadline : next;
                at = &waiter->next;
                continue;
            }
            *at = waiter->next;
            waiter->next = *out;
            *out = waiter;
            s->numbers.waiting--;
        }
    }
    return next;
}

/* Frees queued renders that nobody waits for any more. */
static void prune(struct scheduler *s)
{
    for (int b = 0; b < 2; b++) {
        struct render *next;
        for (struct render *r = s->queue[b][0]; r; r = next) {
            next = r->next;
            if (r->waiters)
                continue;
            unlink_queued(s, r);
            free_render(r);
        }
    }
}

static uint64_t end_overdue(struct scheduler *s, uint64_t now, struct outcome *outcome)
{
    struct waiter *overdue = NULL;
    uint64_t next = UINT64_MAX;
    pthread_mutex_lock(&s->lock);
    struct render *lists[] = {s->queue[0][0], s->queue[1][0], s->running};
    for (int l = 0; l < 3; l++) {
        uint64_t earliest = collect(s, lists[l], now, &overdue);
        next = earliest < next ? earliest : next;
    }
    if (overdue)
        prune(s);
    for (struct waiter *w = overdue; w && now != UINT64_MAX; w = w->next)
        s->numbers.expired++;
    outcome->error.retry_after_s = retry_after(s);
    pthread_mutex_unlock(&s->lock);
    answer_all(overdue, outcome);
    return next;
}

uint64_t scheduler_expire(struct scheduler *s)
{
    struct outcome outcome = {0};
    pen_fail(&outcome.error, PEN_DEADLINE, "/deadline_ms", "The image was not ready in time.");
    return end_overdue(s, clock_now_ns(), &outcome);
}

void scheduler_drain(struct scheduler *s)
{
    pthread_mutex_lock(&s->lock);
    s->numbers.draining = true;
    pthread_mutex_unlock(&s->lock);
}

void scheduler_cancel(struct scheduler *s)
{
    struct outcome outcome = {0};
    pen_fail(&outcome.error, PEN_UNAVAILABLE, "", "The service is shutting down.");
    end_overdue(s, UINT64_MAX, &outcome);
}

void scheduler_read(struct scheduler *s, struct scheduler_numbers *numbers)
{
    pthread_mutex_lock(&s->lock);
    *numbers = s->numbers;
    numbers->full = s->numbers.queued >= s->limits.queue;
    pthread_mutex_unlock(&s->lock);
}
