/* More is asked for than can be done: what is let in is done in time, whatever a render takes beside its
 * time on the renderer, and who is not let in hears it at once; also with comparisons among the renders. A
 * clock of its own, a renderer that divides itself among four renders, and requests that come as a Poisson
 * process does. */
#include "server/base/clock.h"
#include "server/queue/compare.h"
#include "server/queue/scheduler.h"
#include "tests/unit/check.h"
#include <math.h>
#include <string.h>

#define MS CLOCK_MS
#define AT_ONCE 4
#define MOST 8000
#define DEADLINE_MS 5000
#define MEASURED 3 /* renders of a comparison */

static uint64_t now_ns = CLOCK_S;
static uint64_t fake_now(void)
{
    return now_ns;
}

struct client {
    struct waiter waiter; /* first: a waiter is a client */
    uint32_t answers, code;
};

/* What became of them. */
struct tally {
    uint32_t good, late, at_once;
    uint32_t afterwards; /* let in, and then refused */
};
static struct tally renders, comparisons;

static void count(struct tally *tally, const struct pen_error *error)
{
    tally->good += error->code == PEN_OK;
    tally->late += error->code == PEN_DEADLINE;
    tally->afterwards += error->code == PEN_UNAVAILABLE;
    CHECK(error->code != PEN_UNAVAILABLE || error->retry_after_s > 0);
}

static void refuse(struct tally *tally, const struct pen_error *error)
{
    CHECK(error->code == PEN_UNAVAILABLE && error->retry_after_s > 0);
    tally->at_once++;
}

static bool is_over; /* the rest is cancelled */

static void finish(struct waiter *waiter, const struct outcome *outcome)
{
    struct client *client = (struct client *)waiter;
    client->answers++;
    if (!is_over)
        count(&renders, &outcome->error);
}

static void compared(void *owner, struct compare *compare, const struct pen_error *error)
{
    (void)owner;
    if (!is_over)
        count(&comparisons, error);
    compare_destroy(compare);
}

static void on_work(void *context)
{
    (void)context;
}

struct flight {
    struct render *render;
    double left_ms, turns_ms;
};
static struct flight flights[AT_ONCE];
static double speed = 1; /* of the machine */

/* Those of comparisons come one after the other. */
static enum take fits(void *context, struct render *render)
{
    (void)context;
    for (int i = 0; i < AT_ONCE; i++)
        if (flights[i].render && flights[i].render->measure != MEASURE_PICTURE &&
            render->measure != MEASURE_PICTURE)
            return TAKE_LATER;
    return TAKE_FITS;
}

static double uniform(void)
{
    static uint64_t state = 1;
    state = state * 6364136223846793005u + 1442695040888963407u; /* Knuth's MMIX */
    return ((double)(state >> 11) + 0.5) * 0x1p-53;
}

/* What is asked for, how often, and what it takes. */
struct load {
    double rate;     /* requests a second */
    double compared; /* share of comparisons */
    double takes_ms; /* a render */
    double told;     /* share of that which is told as the renderer's */
    double swing; /* the machine is so many times as fast, or slow, at most; 0: always the same */
    double measure_ms; /* beside the renderer, of each image of a comparison */
};

static uint32_t in_flight(void)
{
    uint32_t n = 0;
    for (int i = 0; i < AT_ONCE; i++)
        n += flights[i].render != NULL;
    return n;
}

/* The renderer does its part of `ms` for each that it has; what is done, or not wanted, leaves. */
static void work(struct scheduler *s, double ms)
{
    uint32_t n = in_flight();
    for (int i = 0; i < AT_ONCE; i++) {
        struct flight *f = &flights[i];
        struct render *render = f->render;
        if (!render)
            continue;
        f->left_ms -= ms * speed / n;
        struct pen_result result = {.turns_ms = f->turns_ms};
        struct outcome outcome = {.result = &result};
        if (!scheduler_is_wanted(s, render)) {
            result.turns_ms = 1;
            pen_fail(&outcome.error, PEN_LOST, "", "Nobody waits for it.");
        } else if (f->left_ms > 1e-6) {
            continue;
        }
        f->render = NULL;
        scheduler_finish(s, render, &outcome);
    }
}

static void feed(struct scheduler *s, const struct load *load)
{
    for (int i = 0; i < AT_ONCE; i++) {
        struct flight *f = &flights[i];
        struct render *render =
            f->render ? NULL : scheduler_take(s, &(struct taker){fits, NULL, 0});
        if (!render)
            continue;
        double measure_ms = render->measure == MEASURE_PICTURE ? 0 : load->measure_ms;
        *f = (struct flight){render, load->takes_ms + measure_ms, load->told * load->takes_ms};
    }
}

static void ask(struct scheduler *s, const struct load *load)
{
    static struct client clients[MOST];
    static struct pen_request requests[MEASURED];
    static uint32_t next;
    struct pen_error error = {0};
    uint64_t deadline_ns = now_ns + DEADLINE_MS * MS;
    for (int i = 0; i < MEASURED; i++)
        requests[i] =
            (struct pen_request){.technique = "pcss", .width = 100, .height = 100, .antialias = 1};
    if (uniform() < load->compared) {
        struct compare_plan plan = {.requests = requests,
            .count = MEASURED,
            .client = 1,
            .deadline_ns = deadline_ns,
            .done = compared};
        if (!compare_start(s, &plan, &error))
            refuse(&comparisons, &error);
        return;
    }
    struct client *client = &clients[next++ % MOST];
    *client =
        (struct client){.waiter = {.client = 1, .deadline_ns = deadline_ns, .finish = finish}};
    if (!scheduler_submit(
            s, &requests[0], (uint8_t[PEN_ID_BYTES]){0}, false, &client->waiter, &error))
        refuse(&renders, &error);
}

static void flood(struct scheduler *s, const struct load *load, double seconds)
{
    double due_ms = 0, at_ms = 0, turn_ms = 0;
    uint64_t began = now_ns;
    speed = 1;
    renders = comparisons = (struct tally){0};
    while (at_ms < 1e3 * seconds) {
        double step = due_ms - at_ms;
        feed(s, load);
        for (int i = 0; i < AT_ONCE; i++)
            if (flights[i].render)
                step = fmin(step, flights[i].left_ms * in_flight() / speed);
        step = fmax(step, 1e-3);
        at_ms += step;
        now_ns = began + (uint64_t)(at_ms * 1e6);
        scheduler_expire(s);
        work(s, step);
        if (at_ms < due_ms)
            continue;
        due_ms += -log(uniform()) * 1e3 / load->rate;
        if (load->swing > 1 && at_ms > turn_ms) {
            speed = pow(load->swing, 2 * uniform() - 1);
            turn_ms = at_ms + 1e3 * (0.5 + 3 * uniform());
        }
        ask(s, load);
    }
    is_over = true;
    scheduler_cancel(s);
    work(s, 0);
    is_over = false;
}

static struct scheduler *make(void)
{
    struct scheduler_limits limits = {
        .queue = 256, .client_share = 0, .workers = 1, .now_ns = fake_now};
    return scheduler_create(&limits, on_work, NULL);
}

static void test_renders(double times, double told)
{
    struct scheduler *s = make();
    struct load load = {.rate = 5, .takes_ms = 100, .told = told};
    double seconds = 60, most = 1e3 / load.takes_ms * seconds;
    flood(s, &load, 10); /* what it costs is learned */
    load.rate = times * 1e3 / load.takes_ms;
    flood(s, &load, seconds);
    printf("%.1f times, %.1f told: %u good of %.0f, %u late, %u refused at once, %u afterwards\n",
        times, told, renders.good, most, renders.late, renders.at_once, renders.afterwards);
    CHECK(renders.good >= 0.9 * most);
    CHECK(renders.late <= 0.05 * most);
    scheduler_destroy(s);
}

/* One of twenty is a comparison, whose images take their time beside the renderer, too. */
static void test_mixed(double times, double measure_ms)
{
    struct scheduler *s = make();
    struct load load = {
        .rate = 5, .compared = 0.05, .takes_ms = 40, .told = 0.8, .measure_ms = measure_ms};
    double whole_ms = MEASURED * (load.takes_ms + measure_ms), seconds = 120;
    double mean_ms = 0.95 * load.takes_ms + 0.05 * whole_ms;
    flood(s, &load, 20);
    load.rate = times * 1e3 / mean_ms;
    flood(s, &load, seconds);
    const struct tally *r = &renders, *c = &comparisons;
    double used_ms = r->good * load.takes_ms + c->good * whole_ms;
    uint32_t refused = r->at_once + r->afterwards + c->at_once + c->afterwards;
    printf("%.0f times, %.0f ms: renders %u good, %u late, %u + %u refused; comparisons %u, %u, %u "
           "+ %u; "
           "%.2f of the time\n",
        times, measure_ms, r->good, r->late, r->at_once, r->afterwards, c->good, c->late,
        c->at_once, c->afterwards, used_ms / (1e3 * seconds));
    CHECK(used_ms >= 0.9 * 1e3 * seconds);
    CHECK(c->good > 0);
    CHECK(r->late + c->late <= 0.02 * (r->good + c->good));
    CHECK(r->afterwards + c->afterwards <= 0.01 * refused);
    scheduler_destroy(s);
}

/* The machine does other things, too. */
static void test_swing(double swing)
{
    struct scheduler *s = make();
    struct load load = {.rate = 5, .takes_ms = 50, .told = 0.8, .swing = swing};
    flood(s, &load, 20);
    load.rate = 3 * 1e3 / load.takes_ms;
    flood(s, &load, 200);
    const struct tally *r = &renders;
    uint32_t refused = r->at_once + r->afterwards;
    printf("swing %.1f: %u good, %u late, %u + %u refused\n", swing, r->good, r->late, r->at_once,
        r->afterwards);
    CHECK(r->late <= 0.02 * r->good);
    CHECK(r->afterwards <= 0.01 * refused);
    scheduler_destroy(s);
}

int main(void)
{
    static const double told[] = {1, 0.6, 0.3};
    for (int i = 0; i < 3; i++)
        for (double times = 1.5; times < 4; times *= 2)
            test_renders(times, told[i]);
    for (double times = 2; times < 4; times++)
        for (double measure_ms = 20; measure_ms < 100; measure_ms *= 2)
            test_mixed(times, measure_ms);
    for (double swing = 1.2; swing < 1.7; swing += 0.2)
        test_swing(swing);
    CHECK_DONE();
}
