/* Whose render is next, for how long, and what is refused because it would be late: with a clock of
 * its own and one renderer that takes as long as it is told. */
#include "server/base/clock.h"
#include "server/queue/compare.h"
#include "server/queue/scheduler.h"
#include "tests/unit/check.h"
#include <math.h>
#include <string.h>

#define MS CLOCK_MS

static uint64_t now_ns = CLOCK_S;
static uint64_t fake_now(void)
{
    return now_ns;
}

struct client {
    struct waiter waiter; /* first: a waiter is a client */
    uint32_t answers, code, retry_after_s;
};

static void finish(struct waiter *waiter, const struct outcome *outcome)
{
    struct client *client = (struct client *)waiter;
    client->answers++;
    client->code = outcome->error.code;
}

static void on_work(void *context)
{
    (void)context;
}

static uint64_t only; /* whose renders there is room for; 0: everybody's */
static enum take fits(void *context, struct render *render)
{
    (void)context;
    return only && render->account->client != only ? TAKE_LATER : TAKE_FITS;
}

static struct scheduler *make(uint32_t queue)
{
    struct scheduler_limits limits = {
        .queue = queue, .client_share = 0, .workers = 1, .now_ns = fake_now};
    return scheduler_create(&limits, on_work, NULL);
}

struct ask {
    const char *method;
    uint8_t scene;
    bool batch;
    uint64_t who, deadline_ms;
    uint32_t side;
};

static bool submit(struct scheduler *s, struct client *client, struct ask ask)
{
    struct pen_request request = {.width = ask.side ? ask.side : 100,
        .height = ask.side ? ask.side : 100,
        .antialias = 1,
        .scene = {ask.scene}};
    struct pen_error error = {0};
    snprintf(request.technique, sizeof request.technique, "%s", ask.method);
    request.delivery.priority = ask.batch ? PEN_PRIORITY_BATCH : PEN_PRIORITY_INTERACTIVE;
    memset(client, 0, sizeof *client);
    client->waiter = (struct waiter){.client = ask.who,
        .deadline_ns = now_ns + (ask.deadline_ms ? ask.deadline_ms : 3600000) * MS,
        .finish = finish};
    if (scheduler_submit(s, &request, (uint8_t[PEN_ID_BYTES]){0}, false, &client->waiter, &error))
        return true;
    client->code = error.code;
    client->retry_after_s = error.retry_after_s;
    return false;
}

/* The next one is made in `ms`; returns its client, 0: nothing is queued. */
static uint64_t run(struct scheduler *s, double ms, uint64_t place, struct render *seen)
{
    struct render *render = scheduler_take(s, &(struct taker){fits, NULL, place});
    if (!render)
        return 0;
    now_ns += (uint64_t)(ms * 1e6);
    uint64_t who = render->account->client;
    *seen = *render;
    struct pen_result result = {.turns_ms = ms};
    scheduler_finish(s, render, &(struct outcome){.result = &result});
    return who;
}

/* One whose renders take ten times as long gets as much time, not as many renders. */
static void test_time_not_requests(void)
{
    struct scheduler *s = make(1000);
    static struct client c[400];
    struct render seen;
    double had[3] = {0};
    for (int i = 0; i < 200; i++) {
        CHECK(submit(s, &c[2 * i], (struct ask){"long", 1, false, 1, 0, 0}));
        CHECK(submit(s, &c[2 * i + 1], (struct ask){"short", 2, false, 2, 0, 0}));
    }
    for (int i = 0; i < 110; i++) {
        bool first = i == 0;
        struct render *next = scheduler_take(s, &(struct taker){fits, NULL, 0});
        uint64_t who = next->account->client;
        scheduler_return(s, next);
        double ms = who == 1 ? 100 : 10;
        CHECK(run(s, ms, 0, &seen) == who || first);
        had[who] += ms;
    }
    CHECK(fabs(had[1] - had[2]) <= 300);
    CHECK(had[1] > 800 && had[2] > 800);
    scheduler_cancel(s);
    scheduler_destroy(s);
}

/* Batches come after what is interactive, with a ninth of the time while there is both. */
static void test_batch(void)
{
    struct scheduler *s = make(1000);
    static struct client c[600];
    struct render seen;
    uint32_t batches = 0, first = 0;
    for (int i = 0; i < 300; i++)
        CHECK(submit(s, &c[i], (struct ask){"a", 1, true, 1, 0, 0}));
    for (int i = 300; i < 600; i++)
        CHECK(submit(s, &c[i], (struct ask){"a", 1, false, 1, 0, 0}));
    for (uint32_t i = 1; i <= 270; i++) {
        CHECK(run(s, 50, 0, &seen) == 1);
        batches += seen.batch;
        first = !first && seen.batch ? i : first;
    }
    CHECK(first > 10); /* a second of what is interactive */
    CHECK(batches >= 20 && batches <= 33);
    scheduler_cancel(s);
    scheduler_destroy(s);
}

/* Who comes now and then does not wait for who is always there, and nobody gains by changing names. */
static void test_newcomers(void)
{
    struct scheduler *s = make(4000);
    static struct client c[2000];
    struct render seen;
    int next = 0;
    for (int i = 0; i < 900; i++)
        CHECK(submit(s, &c[next++], (struct ask){"a", 1, false, 1, 0, 0}));
    for (int i = 0; i < 100; i++)
        CHECK(run(s, 50, 0, &seen) == 1);
    for (int i = 0; i < 20; i++) {
        CHECK(submit(s, &c[next++], (struct ask){"a", 2, false, 2, 0, 0}));
        CHECK(run(s, 50, 0, &seen) == 2);
        for (int k = 0; k < 4; k++)
            CHECK(run(s, 50, 0, &seen) == 1);
    }
    double had = 0, all = 0;
    for (uint64_t name = 100; name < 500; name++) {
        CHECK(submit(s, &c[next++], (struct ask){"a", 3, false, name, 0, 0}));
        uint64_t who = run(s, 50, 0, &seen);
        had += who == 1 ? 50 : 0;
        all += 50;
    }
    CHECK(had >= 0.1 * all);
    scheduler_cancel(s);
    scheduler_destroy(s);
}

/* Renders of the place that was drawn last go first, but not for long. */
static void test_places(void)
{
    struct scheduler *s = make(1000);
    static struct client c[120];
    struct render seen = {0};
    uint32_t changes = 0, longest = 0, in_row = 0;
    for (int i = 0; i < 120; i++)
        CHECK(submit(s, &c[i], (struct ask){"a", (uint8_t)(1 + i % 2), false, 1 + i % 2, 0, 0}));
    uint64_t place = 0;
    for (int i = 0; i < 100; i++) {
        CHECK(run(s, 10, place, &seen));
        changes += seen.place != place;
        in_row = seen.place == place ? in_row + 1 : 1;
        longest = in_row > longest ? in_row : longest;
        place = seen.place;
    }
    CHECK(changes <= 40); /* 100 if each came in turn */
    CHECK(longest <= 26); /* 250 ms, and no more often than a few times past one */
    scheduler_cancel(s);
    scheduler_destroy(s);
}

/* Deadlines that what comes first does not leave time for are refused at once, by what is known. */
static void test_deadlines(void)
{
    struct scheduler *s = make(1000);
    static struct client c[40];
    struct render seen;
    struct scheduler_numbers n;
    int next = 0;
    /* Nothing is known: nothing is refused. */
    for (int i = 0; i < 5; i++)
        CHECK(submit(s, &c[next++], (struct ask){"slow", 1, false, 1, 1000, 0}));
    CHECK(run(s, 900, 0, &seen) == 1);
    scheduler_cancel(s);
    /* Six seconds of this client's own come first. */
    for (int i = 0; i < 6; i++)
        CHECK(submit(s, &c[next++], (struct ask){"slow", 1, false, 1, 0, 0}));
    CHECK(!submit(s, &c[next], (struct ask){"slow", 1, false, 1, 2000, 0}));
    CHECK(c[next].code == PEN_UNAVAILABLE);
    CHECK(c[next].retry_after_s >= 2 && c[next].retry_after_s <= 6);
    CHECK(submit(s, &c[next++], (struct ask){"slow", 1, false, 1, 20000, 0}));
    /* They are not in another's way for longer than its own takes. */
    CHECK(submit(s, &c[next++], (struct ask){"slow", 1, false, 2, 2500, 0}));
    /* An unknown method is let in. */
    CHECK(submit(s, &c[next++], (struct ask){"new", 1, false, 3, 100, 0}));
    scheduler_read(s, &n);
    CHECK(n.refused_late == 1 && n.backlog_ms > 5000 && n.estimates > 0);
    while (run(s, 900, 0, &seen))
        ;
    /* With an empty queue even what is known to take too long is let in: it may be wrong. */
    CHECK(submit(s, &c[next++], (struct ask){"slow", 1, false, 1, 100, 0}));
    CHECK(run(s, 900, 0, &seen));
    scheduler_destroy(s);
}

/* An estimate that is wrong corrects itself, also when it keeps everything out. */
static void test_correction(void)
{
    struct scheduler *s = make(1000);
    static struct client c[200];
    struct render seen;
    int next = 0;
    CHECK(submit(s, &c[next++], (struct ask){"a", 1, false, 1, 0, 0}));
    CHECK(run(s, 60000, 0, &seen)); /* such as with a debugger */
    for (int i = 0; i < 3; i++)
        CHECK(submit(s, &c[next++], (struct ask){"a", 1, false, 1, 0, 0}));
    CHECK(!submit(s, &c[next], (struct ask){"a", 1, false, 1, 5000, 0}));
    int refused = 0;
    for (int i = 0; i < 12; i++) {
        CHECK(run(s, 100, 0, &seen));
        CHECK(submit(s, &c[next++], (struct ask){"a", 1, false, 1, 0, 0}));
        refused += !submit(s, &c[next], (struct ask){"a", 1, false, 1, 5000, 0});
        next++;
    }
    CHECK(refused > 0 && refused < 10);
    scheduler_cancel(s);
    /* What has ended by its own deadline is in nobody's way. */
    CHECK(submit(s, &c[next++], (struct ask){"c", 1, false, 1, 0, 0}));
    CHECK(run(s, 60000, 0, &seen));
    CHECK(submit(s, &c[next++], (struct ask){"c", 1, false, 1, 1000, 0}));
    struct render *late = scheduler_take(s, &(struct taker){fits, NULL, 0});
    CHECK(!submit(s, &c[next], (struct ask){"c", 1, false, 1, 900, 0}));
    now_ns += 1100 * MS;
    scheduler_expire(s);
    CHECK(submit(s, &c[next++], (struct ask){"c", 1, false, 1, 1000, 0}));
    scheduler_finish(s, late, &(struct outcome){.error = {.code = PEN_LOST}});
    scheduler_cancel(s);
    /* Nobody is made to wait by what is long past. */
    CHECK(submit(s, &c[next++], (struct ask){"b", 1, false, 1, 0, 0}));
    CHECK(run(s, 60000, 0, &seen));
    CHECK(submit(s, &c[next++], (struct ask){"b", 1, false, 1, 0, 0}));
    CHECK(!submit(s, &c[next], (struct ask){"b", 1, false, 1, 5000, 0}));
    scheduler_cancel(s);
    now_ns += 600 * CLOCK_S;
    CHECK(submit(s, &c[next++], (struct ask){"b", 1, false, 1, 0, 0}));
    CHECK(submit(s, &c[next++], (struct ask){"b", 1, false, 1, 5000, 0}));
    scheduler_cancel(s);
    scheduler_destroy(s);
}

/* Clients who make renders look dear, their own or others', and keep the renderer busy with them, get
 * nobody else refused: not on other scenes, and on theirs only until one was let in to see. */
static void test_dear_ones(void)
{
    struct scheduler *s = make(1000);
    static struct client c[400];
    struct render seen;
    int next = 0;
    for (int i = 0; i < 15; i++) {
        CHECK(submit(s, &c[next++], (struct ask){"a", 1, false, 1 + i % 5, 0, 0}));
        CHECK(run(s, 60000, 0, &seen));
    }
    int refused[2] = {0}, late = 0;
    for (int second = 0; second < 60; second++) {
        for (uint64_t who = 1; who <= 5 && second % 10 == 0; who++)
            CHECK(submit(s, &c[next++], (struct ask){"a", 1, false, who, 0, 0}));
        for (uint8_t scene = 1; scene <= 2; scene++) {
            uint64_t who = 10 + scene;
            if (submit(s, &c[next++], (struct ask){"a", scene, false, who, 5000, 0})) {
                only = who; /* it has its turns beside the dear ones */
                CHECK(run(s, 100, 0, &seen) == who);
                only = 0;
            } else {
                refused[scene - 1]++;
                late += second >= 30;
                CHECK(c[next - 1].code == PEN_UNAVAILABLE && c[next - 1].retry_after_s > 0);
            }
        }
        if (second % 10 == 5)
            run(s, 60000, 0, &seen); /* one of the five */
        now_ns += CLOCK_S;
    }
    CHECK(refused[1] == 0);
    CHECK(refused[0] > 0 && refused[0] <= 12 && late == 0);
    scheduler_cancel(s);
    scheduler_destroy(s);
}

/* One that looked cheap takes what its client may have, and no more: others are served as before. */
static void test_cheap_looks(void)
{
    struct scheduler *s = make(1000);
    static struct client c[400];
    struct render seen;
    int next = 0;
    double had[3] = {0};
    for (int i = 0; i < 20; i++) {
        CHECK(submit(s, &c[next++], (struct ask){"a", 1, false, 1, 0, 0}));
        CHECK(run(s, 1, 0, &seen) == 1);
    }
    for (int i = 0; i < 100; i++) {
        CHECK(submit(s, &c[next++], (struct ask){"a", 1, false, 1, 0, 0}));
        CHECK(submit(s, &c[next++], (struct ask){"b", 2, false, 2, 0, 0}));
    }
    for (int i = 0; i < 60; i++) {
        struct render *render = scheduler_take(s, &(struct taker){fits, NULL, 0});
        uint64_t who = render->account->client;
        double ms = who == 1 ? 2000 : 100;
        now_ns += (uint64_t)(ms * 1e6);
        struct pen_result result = {.turns_ms = ms};
        scheduler_finish(s, render, &(struct outcome){.result = &result});
        had[who] += ms;
    }
    CHECK(had[2] > 1000 && had[1] <= had[2] + 4000);
    scheduler_cancel(s);
    scheduler_destroy(s);
}

/* Larger pictures of the same kind are expected to take longer; the table is bounded. */
static void test_estimates(void)
{
    struct estimates *e = estimates_create(NULL);
    struct pen_request r = {.width = 1000, .height = 1000, .antialias = 1, .scene = {1}};
    strcpy(r.technique, "a");
    CHECK(estimates_of(e, &r, now_ns).ms < 0);
    estimates_learn(e, &r, 100, false, now_ns); /* given up, and nothing is known */
    CHECK(estimates_of(e, &r, now_ns).ms < 0);
    estimates_learn(e, &r, 100, true, now_ns);
    CHECK(fabs(estimates_of(e, &r, now_ns).ms - 100) < 1);
    r.antialias = 4;
    CHECK(fabs(estimates_of(e, &r, now_ns).ms - 400) < 4);
    estimates_learn(e, &r, 100, false, now_ns); /* it would have taken longer: no news */
    CHECK(fabs(estimates_of(e, &r, now_ns).ms - 400) < 4);
    estimates_learn(e, &r, 1200, false, now_ns);
    CHECK(estimates_of(e, &r, now_ns).ms > 450);
    r.scene[0] = 2;
    CHECK(estimates_of(e, &r, now_ns).ms > 400);
    CHECK(estimates_of(e, &r, now_ns).sure < 0.6);
    for (int i = 0; i < 5000; i++) {
        memcpy(r.scene, &i, sizeof i);
        estimates_learn(e, &r, 100, true, ++now_ns);
    }
    CHECK(estimates_count(e) <= 512);
    CHECK(estimates_of(e, &r, now_ns).ms > 0);
    estimates_destroy(e);
}

/* Many names leave nothing behind. */
static void test_many_names(void)
{
    struct accounts *a = accounts_create();
    for (uint64_t name = 1; name < 10000; name++) {
        struct account *account = accounts_enter(a, name, name % 3 == 0, now_ns += MS);
        accounts_charge(a, account, 1);
        accounts_leave(a, account, now_ns);
    }
    uint32_t count = 0;
    for (struct account *c = accounts_first(a); c; c = c->next)
        count++;
    CHECK(count <= 64);
    accounts_destroy(a);
}

#define ITEMS 4

/* A comparison: one measurement after the other. */
struct sequence {
    struct waiter waiter; /* first */
    struct scheduler *scheduler;
    uint32_t at, code;
    bool over;
    uint64_t over_ns;
};

static bool ask_next(struct sequence *q, struct pen_error *error)
{
    struct pen_request requests[ITEMS] = {0};
    for (int i = 0; i < ITEMS; i++) {
        requests[i] =
            (struct pen_request){.width = 100, .height = 100, .antialias = 1, .scene = {1}};
        snprintf(requests[i].technique, sizeof requests[i].technique, "item %d", i);
    }
    q->waiter.continues = q->at > 0;
    q->waiter.following = &requests[q->at + 1];
    q->waiter.following_count = ITEMS - q->at - 1;
    q->waiter.measure = MEASURE_COMPARED;
    return scheduler_submit(
        q->scheduler, &requests[q->at], (uint8_t[PEN_ID_BYTES]){0}, false, &q->waiter, error);
}

static void take_item(struct waiter *waiter, const struct outcome *outcome)
{
    struct sequence *q = (struct sequence *)waiter;
    struct pen_error error = {0};
    CHECK(!q->over);
    q->code = outcome->error.code;
    q->over = q->code || ++q->at == ITEMS || !ask_next(q, &error);
    if (error.code)
        q->code = error.code;
    q->over_ns = now_ns;
}

static bool begin(struct scheduler *s, struct sequence *q, uint64_t deadline_ms)
{
    struct pen_error error = {0};
    *q = (struct sequence){
        .waiter = {.client = 1, .deadline_ns = now_ns + deadline_ms * MS, .finish = take_item},
        .scheduler = s};
    bool ok = ask_next(q, &error);
    CHECK(ok || (error.code == PEN_UNAVAILABLE && error.retry_after_s >= 1));
    return ok;
}

/* 32 comparisons at once: those that are let in are done in time, and begun ones before others. */
static void test_sequences(void)
{
    struct scheduler *s = make(1000);
    static struct sequence q[33];
    struct render seen;
    CHECK(begin(s, &q[32], 30000));
    while (run(s, 500, 0, &seen))
        ;
    CHECK(q[32].over && !q[32].code);
    int accepted = 0;
    for (int i = 0; i < 32; i++)
        accepted += begin(s, &q[i], 30000);
    CHECK(accepted >= 6 && accepted <= 15); /* two seconds each */
    while (run(s, 500, 0, &seen))
        scheduler_expire(s);
    for (int i = 0; i < accepted; i++) {
        CHECK(q[i].over && !q[i].code && q[i].over_ns <= q[i].waiter.deadline_ns);
        CHECK(!i || q[i].over_ns >= q[i - 1].over_ns + 2000 * MS);
    }
    /* What turns out to take five times as long is done as far as the time goes; the others are told
     * as soon as that is known, and not at their deadline. */
    uint64_t begun_ns = now_ns;
    for (int i = accepted = 0; i < 32; i++)
        accepted += begin(s, &q[i], 30000);
    while (run(s, 2500, 0, &seen))
        scheduler_expire(s);
    int done = 0, told = 0;
    for (int i = 0; i < accepted; i++) {
        CHECK(q[i].over);
        done += !q[i].code;
        told += q[i].code == PEN_UNAVAILABLE && q[i].over_ns < begun_ns + 30000 * MS;
    }
    CHECK(done >= 2 && told >= accepted - done - 1);
    scheduler_destroy(s);
}

static void measured(void *owner, struct compare *compare, const struct pen_error *error)
{
    *(uint32_t *)owner = 1 + error->code;
    compare_destroy(compare);
}

/* Measurements that have their time each are not held to that of one for all of them. */
static void test_patience(void)
{
    struct scheduler *s = make(1000);
    struct pen_request requests[ITEMS] = {0};
    struct client other;
    struct render seen;
    struct pen_error error = {0};
    uint32_t over = 0;
    now_ns = clock_now_ns(); /* that of compare.c */
    for (int i = 0; i < ITEMS; i++) {
        requests[i] =
            (struct pen_request){.width = 100, .height = 100, .antialias = 1, .scene = {1}};
        snprintf(requests[i].technique, sizeof requests[i].technique, "item %d", i);
    }
    struct compare_plan plan = {.requests = requests,
        .count = ITEMS,
        .client = 1,
        .patience_ms = 1500,
        .done = measured,
        .owner = &over};
    CHECK(compare_start(s, &plan, &error)); /* nothing is known */
    while (run(s, 500, 0, &seen))
        now_ns = clock_now_ns();
    CHECK(over == 1);
    now_ns = clock_now_ns();
    CHECK(submit(s, &other, (struct ask){"item 0", 1, false, 2, 0, 0}));
    CHECK(compare_start(s, &plan, &error));
    scheduler_cancel(s);
    scheduler_destroy(s);
}

int main(void)
{
    test_patience();
    test_sequences();
    test_time_not_requests();
    test_batch();
    test_newcomers();
    test_places();
    test_deadlines();
    test_correction();
    test_dear_ones();
    test_cheap_looks();
    test_estimates();
    test_many_names();
    CHECK_DONE();
}
