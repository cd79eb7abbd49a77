#include "server/queue/scheduler_state.h"
#include "protocol/memory.h"
#include "server/base/clock.h"
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* After the deadline, for a worker to finish what it has and to encode it. */
#define BEST_GRACE_NS (20 * CLOCK_S)

/* A render of the same place goes first when its client has not had so much more than who is next,
 * and nobody is passed more often. */
#define SAME_PLACE_MS 250.0
#define SAME_PLACE_PASSES 8

struct scheduler *scheduler_create(
    const struct scheduler_limits *limits, void (*on_work)(void *context), void *context)
{
    struct scheduler *s = pen_alloc_zero(1, sizeof *s);
    pthread_mutex_init(&s->lock, NULL);
    s->limits = *limits;
    if (!s->limits.now_ns)
        s->limits.now_ns = clock_now_ns;
    s->shares = shares_create();
    s->accounts = accounts_create();
    s->estimates = estimates_create(limits->catalogue);
    s->on_work = on_work;
    s->context = context;
    s->mean_ms = 50;
    s->measured_ratio = 1.5;
    return s;
}

void scheduler_destroy(struct scheduler *s)
{
    if (!s)
        return;
    pthread_mutex_destroy(&s->lock);
    accounts_destroy(s->accounts);
    estimates_destroy(s->estimates);
    shares_destroy(s->shares);
    free(s);
}

void scheduler_release(struct scheduler *s, uint64_t client)
{
    if (!client)
        return;
    pthread_mutex_lock(&s->lock);
    shares_release(s->shares, client);
    pthread_mutex_unlock(&s->lock);
}

static void push_back(struct scheduler *s, struct render *render)
{
    render->next = NULL;
    if (s->queue[1])
        s->queue[1]->next = render;
    else
        s->queue[0] = render;
    s->queue[1] = render;
    s->numbers.queued++;
    s->numbers.background += render->background;
}

static void push_front(struct scheduler *s, struct render *render)
{
    render->next = s->queue[0];
    s->queue[0] = render;
    if (!s->queue[1])
        s->queue[1] = render;
    s->numbers.queued++;
    s->numbers.background += render->background;
}

/* True when those who wait for an answer have taken all places. */
static bool is_full(const struct scheduler *s)
{
    return s->numbers.queued - s->numbers.background >= s->limits.queue;
}

static void unlink_queued(struct scheduler *s, struct render *render)
{
    struct render *before = NULL;
    for (struct render *at = s->queue[0]; at != render; at = at->next)
        before = at;
    if (before)
        before->next = render->next;
    else
        s->queue[0] = render->next;
    if (s->queue[1] == render)
        s->queue[1] = before;
    s->numbers.queued--;
    s->numbers.background -= render->background;
}

static void unlink_running(struct scheduler *s, struct render *render)
{
    struct render **at = &s->running;
    while (*at != render)
        at = &(*at)->next;
    *at = render->next;
    s->numbers.running--;
}

/* Of one that is in no list any more: it took `ms` of the renderer. With the lock held. */
static void settle(struct scheduler *s, struct render *render, double ms)
{
    accounts_charge(s->accounts, render->account, ms - render->charged_ms);
    accounts_leave(s->accounts, render->account, s->limits.now_ns());
}

static void free_render(struct render *render)
{
    if (render && render->reference_fd > 0)
        close(render->reference_fd);
    free(render);
}

static struct render *find_key(struct scheduler *s, const uint8_t key[PEN_ID_BYTES])
{
    struct render *lists[] = {s->queue[0], s->running};
    for (int l = 0; l < 2; l++)
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

static void set_up(struct render *render, const struct pen_request *request,
    const struct waiter *waiter, struct estimate estimate)
{
    render->request = *request;
    render->batch = request->delivery.priority == PEN_PRIORITY_BATCH;
    render->measure = waiter->measure;
    render->fresh = waiter->fresh;
    snprintf(render->request_id, sizeof render->request_id, "%s",
        waiter->request_id ? waiter->request_id : "");
    render->estimate = estimate;
    if (request->delivery.budget_ms)
        render->estimate.ms = fmin(estimate.ms, request->delivery.budget_ms);
    render->place = picture_place(request);
    render->continues = waiter->continues;
    render->background = waiter->background;
}

static void enter(struct scheduler *s, struct render *render, uint64_t payer)
{
    uint64_t now = s->limits.now_ns();
    if (render->account)
        accounts_leave(s->accounts, render->account, now);
    render->payer = payer;
    render->account = accounts_enter(s->accounts, payer, render->batch, now);
}

bool scheduler_submit(struct scheduler *s, const struct pen_request *request,
    const uint8_t key[PEN_ID_BYTES], bool shareable, struct waiter *waiter, struct pen_error *error)
{
    bool batch = request->delivery.priority == PEN_PRIORITY_BATCH;
    uint64_t payer = waiter->payer ? waiter->payer : waiter->client;
    struct render *fresh = pen_alloc_zero(1, sizeof *fresh);
    pthread_mutex_lock(&s->lock);
    set_up(fresh, request, waiter, estimates_of(s->estimates, request, s->limits.now_ns()));
    fresh->payer = payer;
    scheduler_foresee(s, fresh, waiter);
    uint32_t held = waiter->client ? shares_held(s->shares, waiter->client) : 0;
    struct render *render = shareable ? find_key(s, key) : NULL;
    if (s->numbers.draining) {
        pen_fail(error, PEN_UNAVAILABLE, "", "The service is shutting down.");
    } else if (s->limits.client_share && held >= s->limits.client_share) {
        s->numbers.refused_share++;
        pen_fail(error, PEN_TOO_MANY, "", "This client already has %u renders under way.", held);
    } else if (!render && !fresh->continues && !fresh->background && is_full(s)) {
        s->numbers.refused_full++;
        pen_fail(error, PEN_UNAVAILABLE, "", "The queue is full.");
    } else if (!render && !fresh->continues && scheduler_is_late(s, fresh, waiter, error)) {
        s->numbers.refused_late++;
    } else {
        if (waiter->client)
            shares_use(s->shares, waiter->client);
        if (render) {
            s->numbers.shared++;
            if (!batch && render->batch && !render->running) {
                unlink_queued(s, render);
                render->batch = false;
                enter(s, render, payer);
                push_back(s, render);
            }
        } else {
            render = fresh;
            fresh = NULL;
            render->id = ++s->next_id;
            render->shareable = shareable;
            render->queued_ns = s->limits.now_ns();
            memcpy(render->key, key, PEN_ID_BYTES);
            render->best_until_ns = waiter->best ? waiter->deadline_ns : 0;
            if (waiter->reference_fd > 0)
                render->reference_fd = fcntl(waiter->reference_fd, F_DUPFD_CLOEXEC, 3);
            enter(s, render, payer);
            if (render->continues) /* what was begun is done before the next is */
                push_front(s, render);
            else
                push_back(s, render);
        }
        attach(s, render, waiter);
        render = NULL;
        error = NULL;
    }
    if (error && !error->retry_after_s)
        error->retry_after_s = scheduler_retry_s(s);
    pthread_mutex_unlock(&s->lock);
    free(fresh);
    if (!error)
        s->on_work(s->context);
    return !error;
}

/* Frees queued renders that nobody waits for any more. */
static void prune(struct scheduler *s)
{
    struct render *next;
    for (struct render *r = s->queue[0]; r; r = next) {
        next = r->next;
        if (r->waiters)
            continue;
        unlink_queued(s, r);
        settle(s, r, 0);
        free_render(r);
    }
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

static bool comes_before(const struct render *a, const struct render *b)
{
    double used[] = {a->account->used_ms, b->account->used_ms};
    return used[0] != used[1] ? used[0] < used[1] : b->batch && !a->batch;
}

/* Who is next; NULL: nobody. */
static struct render *choose(const struct scheduler *s, const struct taker *taker)
{
    struct barred barred = {0};
    struct render *best = NULL, *alike = NULL;
    for (struct render *r = s->queue[0]; r; r = r->next) {
        if (is_barred(&barred, r))
            continue;
        enum take take = taker->fits(taker->context, r);
        if (take == TAKE_NOTHING)
            return NULL;
        if (take == TAKE_SCENE_LATER && barred.count < MOST_BARRED)
            barred.scenes[barred.count++] = r->request.scene;
        if (take != TAKE_FITS)
            continue;
        if (!best || comes_before(r, best))
            best = r;
        if (r->place == taker->place && (!alike || comes_before(r, alike)))
            alike = r;
    }
    bool same = alike && alike != best && alike->batch == best->batch &&
                alike->account->used_ms - best->account->used_ms < SAME_PLACE_MS &&
                best->passed < SAME_PLACE_PASSES;
    return same ? alike : best;
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
    scheduler_put_back(render, waiters);
    return render->waiters != NULL;
}

/* The account pays beforehand what it is expected to, so that not all that one client has queued is
 * taken before anybody knows what it costs. */
static void start(struct scheduler *s, struct render *render)
{
    for (struct render *r = s->queue[0]; r != render; r = r->next)
        r->passed++;
    unlink_queued(s, render);
    if (!s->numbers.running)
        scheduler_pace_begin(s);
    render->running = true;
    render->taken_ns = s->limits.now_ns();
    render->charged_ms = render->estimate.ms < 0 ? s->mean_ms : render->estimate.ms;
    accounts_charge(s->accounts, render->account, render->charged_ms);
    render->next = s->running;
    s->running = render;
    s->numbers.running++;
}

/* Answers those that wait to be begun and would be late, now that more is known than when they were
 * let in, rather than at their deadline. */
static void turn_away_hopeless(struct scheduler *s)
{
    struct waiter *list = NULL;
    struct outcome outcome = {0};
    struct render *next;
    pthread_mutex_lock(&s->lock);
    for (struct render *r = s->queue[0]; r; r = next) {
        next = r->next;
        if (!scheduler_is_hopeless(s, r))
            continue;
        while (r->waiters) {
            struct waiter *waiter = r->waiters;
            r->waiters = waiter->next;
            waiter->next = list;
            list = waiter;
            s->numbers.waiting--;
        }
        s->numbers.refused_late++;
    }
    if (list)
        prune(s);
    pen_fail(&outcome.error, PEN_UNAVAILABLE, "/deadline_ms",
        "What was asked for before took longer than was known: this would not be ready in time.");
    outcome.error.retry_after_s = scheduler_retry_s(s);
    pthread_mutex_unlock(&s->lock);
    answer_all(list, &outcome);
}

struct render *scheduler_take(struct scheduler *s, const struct taker *taker)
{
    for (;;) {
        pthread_mutex_lock(&s->lock);
        struct render *render = choose(s, taker);
        if (!render) {
            pthread_mutex_unlock(&s->lock);
            return NULL;
        }
        start(s, render);
        bool wanted = keep_wanted(s, render);
        if (!wanted) {
            unlink_running(s, render);
            settle(s, render, 0);
        }
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
    if (wanted) {
        accounts_charge(s->accounts, render->account, -render->charged_ms);
        render->charged_ms = 0;
        push_front(s, render);
    } else {
        settle(s, render, 0);
    }
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
    double turns_ms = outcome->result ? outcome->result->turns_ms : 0;
    double ms = turns_ms > 0 ? turns_ms : clock_ms(s->limits.now_ns() - render->taken_ns);
    bool ok = answer.error.code == PEN_OK, given_up = answer.error.code == PEN_LOST;
    if (ok)
        s->mean_ms += 0.1 * (ms - s->mean_ms);
    /* What was there already cost nothing, and a sketch tells nothing of the whole. */
    const struct pen_progress *progress = outcome->result ? &outcome->result->progress : NULL;
    bool tells = !progress || (!progress->kept && (!ok || progress->done || !progress->total));
    if ((ok || given_up) && tells)
        estimates_learn(s->estimates, &render->request, ms / picture_share(outcome->result), ok,
            s->limits.now_ns());
    settle(s, render, ms);
    scheduler_pace(s, render, ok && tells, ms);
    double run_ms = clock_ms(s->limits.now_ns() - render->taken_ns);
    bool measured = render->measure != MEASURE_PICTURE;
    if (ok && measured)
        scheduler_learn_ratio(s, ms, run_ms);
    if (!ok)
        answer.error.retry_after_s = scheduler_retry_s(s);
    answer.run_ms = run_ms;
    pthread_mutex_unlock(&s->lock);
    answer.queue_ms = clock_ms(render->taken_ns - render->queued_ns);
    answer.shared = count > 1;
    answer_all(waiters, &answer);
    free_render(render);
    turn_away_hopeless(s);
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

static uint64_t end_overdue(struct scheduler *s, uint64_t now, struct outcome *outcome)
{
    struct waiter *overdue = NULL;
    uint64_t next = UINT64_MAX;
    pthread_mutex_lock(&s->lock);
    struct render *lists[] = {s->queue[0], s->running};
    for (int l = 0; l < 2; l++) {
        uint64_t earliest = collect(s, lists[l], now, &overdue);
        next = earliest < next ? earliest : next;
    }
    if (overdue)
        prune(s);
    for (struct waiter *w = overdue; w && now != UINT64_MAX; w = w->next)
        s->numbers.expired++;
    outcome->error.retry_after_s = scheduler_retry_s(s);
    pthread_mutex_unlock(&s->lock);
    answer_all(overdue, outcome);
    return next;
}

uint64_t scheduler_expire(struct scheduler *s)
{
    struct outcome outcome = {0};
    pen_fail(&outcome.error, PEN_DEADLINE, "/deadline_ms", "The image was not ready in time.");
    return end_overdue(s, s->limits.now_ns(), &outcome);
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
    numbers->full = is_full(s);
    numbers->backlog_ms = scheduler_backlog_ms(s, 0);
    numbers->estimates = estimates_count(s->estimates);
    pthread_mutex_unlock(&s->lock);
}
