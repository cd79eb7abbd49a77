/* Order, limits, sharing, deadlines and retries of the queue; then all of it from many threads. */
#include "server/base/clock.h"
#include "server/queue/compare.h"
#include "server/queue/scheduler.h"
#include "tests/unit/check.h"
#include <pthread.h>
#include <unistd.h>

struct client {
    struct waiter waiter; /* first: a waiter is a client */
    uint32_t answers, code;
    bool shared, gone;
    uint32_t parts;
};

static void finish(struct waiter *waiter, const struct outcome *outcome)
{
    struct client *client = (struct client *)waiter;
    client->code = outcome->error.code;
    client->shared = outcome->shared;
    __atomic_add_fetch(&client->answers, 1, __ATOMIC_ACQ_REL);
}

static bool is_gone(struct waiter *waiter)
{
    return ((struct client *)waiter)->gone;
}

static void part(struct waiter *waiter, struct picture *picture)
{
    struct client *client = (struct client *)waiter;
    CHECK(picture && client->answers == 0);
    client->parts++;
}

static uint32_t wakes;
static void on_work(void *context)
{
    (void)context;
    __atomic_add_fetch(&wakes, 1, __ATOMIC_RELAXED);
}

static bool submit(struct scheduler *s, struct client *client, uint8_t key, bool batch,
    bool shareable, uint64_t who, uint64_t deadline_ms, struct pen_error *error)
{
    struct pen_request request = {.width = key};
    uint8_t id[PEN_ID_BYTES] = {key};
    memset(client, 0, sizeof *client);
    request.delivery.priority = batch ? PEN_PRIORITY_BATCH : PEN_PRIORITY_INTERACTIVE;
    client->waiter = (struct waiter){.client = who,
        .deadline_ns = clock_now_ns() + deadline_ms * CLOCK_MS,
        .is_gone = is_gone,
        .finish = finish};
    bool ok = scheduler_submit(s, &request, id, shareable, &client->waiter, error);
    CHECK(ok || !error || (error->retry_after_s >= 1 && error->retry_after_s <= 600));
    return ok;
}

static enum take fits_always(void *context, struct render *render)
{
    (void)context, (void)render;
    return TAKE_FITS;
}
static const struct taker any = {fits_always, NULL};

static uint32_t take_and_finish(struct scheduler *s, uint32_t code)
{
    struct render *render = scheduler_take(s, &any);
    if (!render)
        return 0;
    uint32_t width = render->request.width;
    struct outcome outcome = {0};
    if (code)
        pen_fail(&outcome.error, code, "", "No.");
    scheduler_finish(s, render, &outcome);
    return width;
}

static struct scheduler *make(uint32_t queue, uint32_t share)
{
    struct scheduler_limits limits = {queue, share, 1};
    return scheduler_create(&limits, on_work, NULL);
}

static void test_order(void)
{
    struct scheduler *s = make(100, 0);
    struct client c[24];
    CHECK(scheduler_take(s, &any) == NULL);
    for (uint8_t i = 0; i < 4; i++)
        CHECK(submit(s, &c[i], 100 + i, true, true, 1, 1000, NULL));
    for (uint8_t i = 4; i < 24; i++)
        CHECK(submit(s, &c[i], i, false, true, 1, 1000, NULL));
    uint32_t batch_turns = 0, last = 0;
    for (int i = 0; i < 24; i++) {
        uint32_t key = take_and_finish(s, 0);
        if (key >= 100) {
            batch_turns++;
            CHECK(key == 99 + batch_turns); /* in order among themselves */
            CHECK(i >= 20);                 /* after what takes no time; see server_fairness.c */
        } else {
            CHECK(key > last);
            last = key;
        }
    }
    CHECK(batch_turns == 4);
    for (int i = 0; i < 24; i++)
        CHECK(c[i].answers == 1 && c[i].code == 0);
    scheduler_destroy(s);
}

static void test_limits(void)
{
    struct scheduler *s = make(3, 2);
    struct client c[8];
    struct pen_error error = {0};
    CHECK(submit(s, &c[0], 1, false, true, 7, 1000, &error));
    CHECK(submit(s, &c[1], 2, false, true, 7, 1000, &error));
    CHECK(!submit(s, &c[2], 3, false, true, 7, 1000, &error));
    CHECK(error.code == PEN_TOO_MANY && error.retry_after_s);
    error.code = 0;
    CHECK(submit(s, &c[3], 3, false, true, 8, 1000, &error));
    CHECK(!submit(s, &c[4], 4, false, true, 9, 1000, &error));
    CHECK(error.code == PEN_UNAVAILABLE && error.retry_after_s);
    error.code = 0;
    /* One that joins needs no room in the queue. */
    CHECK(submit(s, &c[4], 3, false, true, 9, 1000, &error));
    struct scheduler_numbers n;
    scheduler_read(s, &n);
    CHECK(n.queued == 3 && n.full && n.waiting == 4 && n.shared == 1);
    CHECK(n.refused_full == 1 && n.refused_share == 1);
    /* The share is held until released, whatever becomes of the render. */
    CHECK(take_and_finish(s, 0) == 1);
    CHECK(!submit(s, &c[2], 5, false, true, 7, 1000, &error));
    CHECK(error.code == PEN_TOO_MANY);
    error.code = 0;
    scheduler_release(s, 7);
    CHECK(submit(s, &c[2], 5, false, true, 7, 1000, &error));
    while (take_and_finish(s, 0))
        ;
    CHECK(c[3].shared && c[4].shared && !c[0].shared);
    scheduler_drain(s);
    CHECK(!submit(s, &c[5], 6, false, true, 10, 1000, &error));
    CHECK(error.code == PEN_UNAVAILABLE);
    scheduler_destroy(s);
}

static void test_sharing(void)
{
    struct scheduler *s = make(10, 0);
    struct client a, b, c, d;
    CHECK(submit(s, &a, 1, true, true, 1, 1000, NULL));
    CHECK(submit(s, &d, 2, true, true, 1, 1000, NULL));
    CHECK(submit(s, &b, 2, false, true, 2, 1000, NULL)); /* lifts the batch render it joins */
    struct render *render = scheduler_take(s, &any);
    CHECK(render && render->request.width == 2);
    CHECK(submit(s, &c, 2, false, false, 3, 1000, NULL)); /* wants its own */
    struct client late;
    CHECK(submit(s, &late, 2, false, true, 4, 1000, NULL)); /* joins the running one */
    struct outcome outcome = {0};
    scheduler_finish(s, render, &outcome);
    CHECK(
        b.answers == 1 && d.answers == 1 && late.answers == 1 && a.answers == 0 && c.answers == 0);
    CHECK(take_and_finish(s, 0) == 2 && c.answers == 1 && !c.shared);
    CHECK(take_and_finish(s, 0) == 1 && a.answers == 1);
    scheduler_destroy(s);
}

static void test_time(void)
{
    struct scheduler *s = make(10, 0);
    struct client queued, running, patient;
    CHECK(submit(s, &running, 1, false, true, 1, 20, NULL));
    struct render *render = scheduler_take(s, &any);
    CHECK(submit(s, &queued, 2, false, true, 1, 20, NULL));
    CHECK(submit(s, &patient, 3, false, true, 1, 60000, NULL));
    uint64_t next = scheduler_expire(s);
    CHECK(queued.answers == 0 && running.answers == 0);
    CHECK(next > clock_now_ns() && next <= clock_now_ns() + 20 * CLOCK_MS);
    usleep(30000);
    next = scheduler_expire(s);
    CHECK(queued.answers == 1 && queued.code == PEN_DEADLINE);
    CHECK(running.answers == 1 && running.code == PEN_DEADLINE);
    CHECK(patient.answers == 0 && next == patient.waiter.deadline_ns);
    struct outcome outcome = {0};
    scheduler_finish(s, render, &outcome); /* nobody waits any more */
    CHECK(running.answers == 1);
    struct scheduler_numbers n;
    scheduler_read(s, &n);
    CHECK(n.expired == 2 && n.queued == 1 && n.running == 0 && n.waiting == 1);
    scheduler_cancel(s);
    CHECK(patient.answers == 1 && patient.code == PEN_UNAVAILABLE);
    CHECK(scheduler_take(s, &any) == NULL);
    scheduler_destroy(s);
}

static void test_return_and_gone(void)
{
    struct scheduler *s = make(10, 0);
    struct client a, b, gone;
    CHECK(submit(s, &a, 1, false, true, 1, 1000, NULL));
    CHECK(submit(s, &b, 2, false, true, 1, 1000, NULL));
    struct render *render = scheduler_take(s, &any);
    render->attempts = 1;
    scheduler_return(s, render); /* first again */
    render = scheduler_take(s, &any);
    CHECK(render->request.width == 1 && render->attempts == 1);
    struct outcome outcome = {0};
    scheduler_finish(s, render, &outcome);
    CHECK(submit(s, &gone, 3, false, true, 1, 1000, NULL));
    gone.gone = true;
    CHECK(take_and_finish(s, 0) == 2);
    CHECK(scheduler_take(s, &any) == NULL);
    CHECK(gone.answers == 1 && gone.code == PEN_TIMEOUT && a.answers == 1 && b.answers == 1);
    struct scheduler_numbers n;
    scheduler_read(s, &n);
    CHECK(n.abandoned == 1 && n.waiting == 0 && n.queued == 0 && n.running == 0);
    scheduler_destroy(s);
}

/* What cannot be taken is passed, and its scene with it or not, or nothing is taken before it. */
struct choosy {
    enum take answers[8]; /* by width */
};

static enum take fits_choosy(void *context, struct render *render)
{
    return ((struct choosy *)context)->answers[render->request.width];
}

static uint32_t take_width(struct scheduler *s, struct choosy *choosy)
{
    struct render *render = scheduler_take(s, &(struct taker){fits_choosy, choosy});
    if (!render)
        return 0;
    uint32_t width = render->request.width;
    scheduler_finish(s, render, &(struct outcome){0});
    return width;
}

static void test_what_does_not_fit(void)
{
    struct scheduler *s = make(10, 0);
    struct client c[5];
    struct choosy choosy = {{0}};
    for (uint8_t i = 1; i <= 4; i++)
        CHECK(submit(s, &c[i], i, false, true, 1, 60000, NULL)); /* all of one scene */
    choosy.answers[1] = TAKE_LATER;
    CHECK(take_width(s, &choosy) == 2);
    choosy.answers[1] = TAKE_SCENE_LATER;
    CHECK(take_width(s, &choosy) == 0);
    choosy.answers[1] = TAKE_NOTHING;
    CHECK(take_width(s, &choosy) == 0);
    choosy.answers[1] = TAKE_FITS;
    choosy.answers[3] = TAKE_NOTHING;
    CHECK(take_width(s, &choosy) == 0);
    choosy.answers[3] = TAKE_LATER;
    CHECK(take_width(s, &choosy) == 1);
    CHECK(take_width(s, &choosy) == 4);
    CHECK(take_width(s, &choosy) == 0);
    choosy.answers[3] = TAKE_FITS;
    struct render *render = scheduler_take(s, &any);
    CHECK(render->request.width == 3 && render->passed == 1);
    scheduler_finish(s, render, &(struct outcome){0});
    scheduler_destroy(s);
}

#define SUBMITTERS 4
#define PER_THREAD 400
static struct client crowd[SUBMITTERS][PER_THREAD];
static bool crowd_done;

static void *submitter(void *argument)
{
    struct scheduler *s = ((void **)argument)[0];
    struct client *mine = ((void **)argument)[1];
    for (uint32_t i = 0; i < PER_THREAD; i++) {
        struct pen_error error = {0};
        while (!submit(s, &mine[i], (uint8_t)(i % 50 + 1), i % 3 == 0, i % 2, 0,
            i % 7 == 0 ? 1 : 5000, &error)) {
            CHECK(error.code == PEN_UNAVAILABLE);
            error.code = 0;
            usleep(50);
        }
    }
    return NULL;
}

static void *worker(void *argument)
{
    struct scheduler *s = argument;
    uint32_t n = 0;
    while (!__atomic_load_n(&crowd_done, __ATOMIC_ACQUIRE)) {
        scheduler_expire(s);
        struct render *render = scheduler_take(s, &any);
        struct outcome outcome = {0};
        if (!render)
            usleep(20);
        else if (++n % 5 == 0)
            scheduler_return(s, render);
        else
            scheduler_finish(s, render, &outcome);
    }
    return NULL;
}

/* Every client is answered exactly once, whatever overlaps. */
static void test_threads(void)
{
    struct scheduler *s = make(8, 0);
    pthread_t threads[SUBMITTERS + 2];
    void *arguments[SUBMITTERS][2];
    for (int i = 0; i < 2; i++)
        pthread_create(&threads[SUBMITTERS + i], NULL, worker, s);
    for (int i = 0; i < SUBMITTERS; i++) {
        arguments[i][0] = s;
        arguments[i][1] = crowd[i];
        pthread_create(&threads[i], NULL, submitter, arguments[i]);
    }
    for (int i = 0; i < SUBMITTERS; i++)
        pthread_join(threads[i], NULL);
    struct scheduler_numbers n;
    for (int i = 0; i < 2000; i++) {
        scheduler_read(s, &n);
        if (!n.waiting && !n.queued && !n.running)
            break;
        usleep(1000);
    }
    __atomic_store_n(&crowd_done, true, __ATOMIC_RELEASE);
    for (int i = 0; i < 2; i++)
        pthread_join(threads[SUBMITTERS + i], NULL);
    CHECK(!n.waiting && !n.queued && !n.running);
    for (int i = 0; i < SUBMITTERS; i++)
        for (int k = 0; k < PER_THREAD; k++)
            CHECK(crowd[i][k].answers == 1);
    CHECK(wakes > 0);
    scheduler_destroy(s);
}

/* Who wants a picture so far gets the next one, once; others do not. */
static void test_parts(void)
{
    struct scheduler *s = make(100, 0);
    struct client c[3];
    struct picture picture = {0};
    for (int i = 0; i < 3; i++) {
        CHECK(submit(s, &c[i], 7, false, true, 1, 1000, NULL));
        c[i].waiter.part = part;
    }
    uint32_t before = wakes;
    struct render *render = scheduler_take(s, &any);
    CHECK(render && !scheduler_wants_part(s, render));
    scheduler_show_part(s, render, &picture);
    CHECK(c[0].parts == 0 && wakes == before);
    scheduler_want_part(s, &c[0].waiter);
    scheduler_want_part(s, &c[2].waiter);
    scheduler_want_part(s, &c[2].waiter);
    CHECK(wakes == before + 3 && scheduler_wants_part(s, render));
    scheduler_show_part(s, render, &picture);
    scheduler_show_part(s, render, &picture);
    CHECK(c[0].parts == 1 && c[1].parts == 0 && c[2].parts == 1);
    CHECK(!scheduler_wants_part(s, render));
    scheduler_want_part(s, &c[1].waiter);
    scheduler_return(s, render); /* a worker died: still wanted from the next one */
    render = scheduler_take(s, &any);
    CHECK(render && scheduler_wants_part(s, render));
    c[1].gone = true;
    CHECK(scheduler_is_wanted(s, render) && !scheduler_wants_part(s, render));
    scheduler_finish(s, render, &(struct outcome){0});
    for (int i = 0; i < 3; i++)
        CHECK(c[i].answers == 1);
    scheduler_want_part(s, &c[0].waiter); /* too late, which does no harm */
    scheduler_destroy(s);
}

static void measured(void *owner, struct compare *compare, const struct pen_error *error)
{
    CHECK(error->code == PEN_OK);
    *(uint32_t *)owner = compare_done_count(compare);
    compare_destroy(compare);
}

/* What is timed starts from nothing: a render that goes on from kept sums costs next to nothing. */
static void test_measured_is_fresh(void)
{
    struct scheduler *s = make(4, 0);
    struct pen_request requests[3] = {{.width = 1}, {.width = 2}, {.width = 2}};
    const uint32_t measures[3] = {MEASURE_REFERENCE, MEASURE_PICTURE, MEASURE_PICTURE};
    uint32_t done = 0;
    struct compare_plan plan = {.requests = requests,
        .count = 3,
        .measures = measures,
        .patience_ms = 60000,
        .done = measured,
        .owner = &done};
    CHECK(compare_start(s, &plan, NULL));
    for (int i = 0; i < 3; i++) {
        struct render *render = scheduler_take(s, &any);
        CHECK(render && render->fresh);
        if (render)
            scheduler_finish(s, render, &(struct outcome){0});
    }
    CHECK(done == 3);
    scheduler_destroy(s);
}

/* Of those whose owner bounds them any number waits, and they leave the others' places alone. */
static void background_takes_no_place(void)
{
    struct scheduler *s = make(1, 0);
    struct client clients[5];
    struct pen_error error = {0};
    struct scheduler_numbers numbers;
    for (uint8_t i = 0; i < 3; i++) {
        struct pen_request request = {.width = i + 1};
        uint8_t id[PEN_ID_BYTES] = {i + 1};
        memset(&clients[i], 0, sizeof clients[i]);
        clients[i].waiter = (struct waiter){.payer = 1,
            .deadline_ns = clock_now_ns() + 60 * CLOCK_S,
            .background = true,
            .finish = finish};
        request.delivery.priority = PEN_PRIORITY_BATCH;
        CHECK(scheduler_submit(s, &request, id, true, &clients[i].waiter, &error));
    }
    scheduler_read(s, &numbers);
    CHECK(numbers.queued == 3 && numbers.background == 3 && !numbers.full);
    CHECK(submit(s, &clients[3], 9, false, true, 2, 60000, &error));
    CHECK(!submit(s, &clients[4], 10, false, true, 2, 60000, &error));
    CHECK(error.code == PEN_UNAVAILABLE);
    CHECK(take_and_finish(s, 0) == 9);
    for (int i = 0; i < 3; i++)
        CHECK(take_and_finish(s, 0));
    scheduler_read(s, &numbers);
    CHECK(numbers.queued == 0 && numbers.background == 0);
    scheduler_destroy(s);
}

int main(void)
{
    background_takes_no_place();
    test_measured_is_fresh();
    test_parts();
    test_order();
    test_limits();
    test_sharing();
    test_time();
    test_return_and_gone();
    test_what_does_not_fit();
    test_threads();
    CHECK_DONE();
}
