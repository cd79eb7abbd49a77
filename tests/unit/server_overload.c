/* More is asked for than can be done: what is let in is done in time, whatever a render takes beside its
 * time on the renderer. A clock of its own, a renderer that divides itself among four renders, and
 * requests that come as a Poisson process does. */
#include "server/base/clock.h"
#include "server/queue/scheduler.h"
#include "tests/unit/check.h"
#include <math.h>
#include <string.h>

#define MS CLOCK_MS
#define AT_ONCE 4
#define MOST 8000
#define DEADLINE_MS 5000

static uint64_t now_ns = CLOCK_S;
static uint64_t fake_now(void)
{
    return now_ns;
}

struct client {
    struct waiter waiter; /* first: a waiter is a client */
    uint32_t answers, code;
};

static uint32_t good, late, turned_away;

static void finish(struct waiter *waiter, const struct outcome *outcome)
{
    struct client *client = (struct client *)waiter;
    client->answers++;
    good += outcome->error.code == PEN_OK;
    late += outcome->error.code == PEN_DEADLINE;
    turned_away += outcome->error.code == PEN_UNAVAILABLE;
    CHECK(outcome->error.code != PEN_UNAVAILABLE || outcome->error.retry_after_s > 0);
}

static void on_work(void *context)
{
    (void)context;
}

static enum take fits(void *context, struct render *render)
{
    (void)context, (void)render;
    return TAKE_FITS;
}

static double uniform(void)
{
    static uint64_t state = 1;
    state = state * 6364136223846793005u + 1442695040888963407u; /* Knuth's MMIX */
    return ((double)(state >> 11) + 0.5) * 0x1p-53;
}

struct flight {
    struct render *render;
    double left_ms;
};

/* The renderer does its part of `ms` for each that it has; what is done, or not wanted, leaves. */
static void work(struct scheduler *s, struct flight *flights, double ms, double turns_ms)
{
    int count = 0;
    for (int i = 0; i < AT_ONCE; i++)
        count += flights[i].render != NULL;
    for (int i = 0; i < AT_ONCE; i++) {
        struct flight *f = &flights[i];
        if (!f->render)
            continue;
        f->left_ms -= ms / count;
        struct pen_result result = {.turns_ms = turns_ms};
        struct outcome outcome = {.result = &result};
        if (!scheduler_is_wanted(s, f->render)) {
            result.turns_ms = 1;
            pen_fail(&outcome.error, PEN_LOST, "", "Nobody waits for it.");
        } else if (f->left_ms > 1e-6) {
            continue;
        }
        scheduler_finish(s, f->render, &outcome);
        f->render = NULL;
    }
}

static void feed(struct scheduler *s, struct flight *flights, double takes_ms)
{
    for (int i = 0; i < AT_ONCE; i++) {
        if (flights[i].render)
            continue;
        flights[i].render = scheduler_take(s, &(struct taker){fits, NULL, 0});
        flights[i].left_ms = takes_ms;
    }
}

/* `rate` requests a second for so long; a render takes `takes_ms`, of which turns_ms are told. */
static void flood(
    struct scheduler *s, double rate, double seconds, double takes_ms, double turns_ms)
{
    static struct client clients[MOST];
    struct flight flights[AT_ONCE] = {0};
    struct pen_request request = {.technique = "pcss", .width = 100, .height = 100, .antialias = 1};
    double due_ms = 0, at_ms = 0;
    uint64_t began = now_ns;
    uint32_t next = 0;
    good = late = turned_away = 0;
    while (at_ms < 1e3 * seconds) {
        int count = 0;
        double step = due_ms - at_ms;
        feed(s, flights, takes_ms);
        for (int i = 0; i < AT_ONCE; i++)
            count += flights[i].render != NULL;
        for (int i = 0; i < AT_ONCE; i++)
            if (flights[i].render)
                step = fmin(step, flights[i].left_ms * count);
        step = fmax(step, 1e-3);
        at_ms += step;
        now_ns = began + (uint64_t)(at_ms * 1e6);
        scheduler_expire(s);
        work(s, flights, step, turns_ms);
        if (at_ms < due_ms)
            continue;
        due_ms += -log(uniform()) * 1e3 / rate;
        CHECK(next < MOST);
        struct client *client = &clients[next++];
        struct pen_error error = {0};
        memset(client, 0, sizeof *client);
        client->waiter = (struct waiter){
            .client = 1, .deadline_ns = now_ns + DEADLINE_MS * MS, .finish = finish};
        if (!scheduler_submit(
                s, &request, (uint8_t[PEN_ID_BYTES]){0}, false, &client->waiter, &error)) {
            CHECK(error.code == PEN_UNAVAILABLE && error.retry_after_s > 0);
            turned_away++;
        }
    }
    scheduler_cancel(s);
    work(s, flights, 0, turns_ms);
}

int main(void)
{
    static const double told[] = {1, 0.6, 0.3};
    for (int i = 0; i < 3; i++)
        for (double times = 1.5; times < 4; times *= 2) {
            struct scheduler_limits limits = {
                .queue = 256, .client_share = 0, .workers = 1, .now_ns = fake_now};
            struct scheduler *s = scheduler_create(&limits, on_work, NULL);
            double takes_ms = 100, seconds = 60, most = 1e3 / takes_ms * seconds;
            flood(s, 5, 10, takes_ms, told[i] * takes_ms); /* what it costs is learned */
            flood(s, times * 10, seconds, takes_ms, told[i] * takes_ms);
            printf("%.1f times, %.1f told: %u good of %.0f, %u late, %u turned away\n", times,
                told[i], good, most, late, turned_away);
            CHECK(good >= 0.9 * most);
            CHECK(late <= 0.05 * most);
            scheduler_destroy(s);
        }
    CHECK_DONE();
}
