/* Whose turn on the renderer is next: with a renderer that does what it is told, a piece at a time. */
#include "server/base/clock.h"
#include "server/queue/turn_order.h"
#include "tests/unit/check.h"
#include <math.h>

#define PIECE_MS 5.0
#define MOST 6

struct render {
    struct turn_order order; /* first: found again from it */
    struct account *account;
    double takes_ms, came_ms;
    bool there;
};

struct worker {
    struct accounts *accounts;
    struct render renders[MOST];
    struct render *current;
    uint64_t arrivals;
    double now_ms;
};

static void begin(struct worker *w, uint64_t client, bool batch, double takes_ms)
{
    struct render *r = w->renders;
    while (r->there)
        r++;
    struct account *account =
        accounts_enter(w->accounts, client, batch, (uint64_t)(w->now_ms * CLOCK_MS));
    *r = (struct render){.order = {.account = account, .arrived = ++w->arrivals},
        .account = account,
        .takes_ms = takes_ms,
        .came_ms = w->now_ms,
        .there = true};
}

/* A piece of the next one; whose has ended with it, and after how long. 0: none has. */
static uint64_t run(struct worker *w, double *after_ms)
{
    const struct turn_order *orders[MOST];
    uint32_t count = 0;
    for (int i = 0; i < MOST; i++)
        if (w->renders[i].there)
            orders[count++] = &w->renders[i].order;
    struct render *r =
        (struct render *)turn_order_next(orders, count, w->current ? &w->current->order : NULL);
    w->current = r;
    w->now_ms += PIECE_MS;
    if (!r)
        return 0;
    r->order.ms += PIECE_MS;
    accounts_charge(w->accounts, r->account, PIECE_MS);
    if (r->order.ms < r->takes_ms)
        return 0;
    *after_ms = w->now_ms - r->came_ms;
    uint64_t client = r->account->client;
    accounts_leave(w->accounts, r->account, (uint64_t)(w->now_ms * CLOCK_MS));
    r->there = false;
    w->current = NULL;
    return client;
}

/* Who asks now and then waits for one piece of what another floods the worker with. */
static void test_flood(double flood_ms, bool batch)
{
    struct worker w = {.accounts = accounts_create()};
    const double takes_ms = 60, every_ms = 500;
    double due_ms = 700, after_ms, worst_ms = 0;
    uint32_t done = 0, flood = 0;
    while (w.now_ms < 60e3) {
        while (flood < 4)
            begin(&w, 1, batch, flood_ms), flood++;
        if (w.now_ms >= due_ms) {
            begin(&w, 2, false, takes_ms);
            due_ms += every_ms;
        }
        uint64_t who = run(&w, &after_ms);
        flood -= who == 1;
        done += who == 2;
        worst_ms = who == 2 ? fmax(worst_ms, after_ms) : worst_ms;
    }
    CHECK(done >= 117);
    CHECK(worst_ms <= takes_ms + PIECE_MS);
    accounts_destroy(w.accounts);
}

/* Equals are done one after the other, which is sooner for the mean of them. */
static void test_equals(void)
{
    struct worker w = {.accounts = accounts_create()};
    double after_ms, sum_ms = 0;
    for (int round = 0; round < 50; round++) {
        begin(&w, 1, false, 60);
        begin(&w, 2, false, 60);
        for (int done = 0; done < 2;)
            if (run(&w, &after_ms)) {
                sum_ms += after_ms;
                done++;
            }
    }
    CHECK(fabs(sum_ms / 100 - 90) < 1);
    accounts_destroy(w.accounts);
}

/* Short ones of a client do not wait for long ones of the same. */
static void test_own(void)
{
    struct worker w = {.accounts = accounts_create()};
    double after_ms;
    begin(&w, 1, false, 10e3);
    for (int i = 0; i < 100; i++)
        CHECK(!run(&w, &after_ms));
    begin(&w, 1, false, 50);
    while (!run(&w, &after_ms))
        ;
    CHECK(after_ms <= 50 + PIECE_MS);
    accounts_destroy(w.accounts);
}

int main(void)
{
    test_flood(60, false);
    test_flood(90, false);
    test_flood(5000, false);
    test_flood(60, true);
    test_equals();
    test_own();
    CHECK_DONE();
}
