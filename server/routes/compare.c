/* Methods against a reference: one document, or every method as soon as it is measured, as server-sent
 * events. What is measured may outlive the call, when the client leaves: both hold the same. */
#include "server/queue/compare.h"
#include "protocol/json_compare.h"
#include "protocol/memory.h"
#include "server/auto/choice.h"
#include "server/base/clock.h"
#include "server/http/accept.h"
#include "server/jobs/compared.h"
#include "server/routes/routes.h"
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define KEEP_ALIVE_NS (15 * CLOCK_S) /* proxies close what is silent for longer */

struct comparing {
    struct pen_compare asked; /* constant once it was read */
    bool events;
    pthread_mutex_t lock;    /* guards what follows, and is held while http.h is called */
    uint32_t references;     /* the call's and the measurement's */
    struct call *call;       /* NULL: it has ended */
    struct compare *compare; /* once a row is there */
    uint32_t ready;          /* rows that are there; with all of them, or an error, it is over */
    struct pen_error failure;
    bool over, resumed, asleep, keep_alive;
    uint64_t slept_ns;
    /* Of the thread that sends: */
    uint32_t sent; /* rows */
    bool ended;
    char *text;
    size_t bytes, at;
};

/* What the call holds. */
struct handle {
    struct comparing *comparing;
    bool holds_share;
};

static struct comparing *comparing_of(const struct call *call)
{
    return ((struct handle *)call->work)->comparing;
}

static void release(struct comparing *c)
{
    pthread_mutex_lock(&c->lock);
    bool unused = --c->references == 0;
    pthread_mutex_unlock(&c->lock);
    if (!unused)
        return;
    compare_destroy(c->compare);
    pthread_mutex_destroy(&c->lock);
    free(c->text);
    free(c);
}

static enum step_end read_body(struct call *call, struct pen_error *error)
{
    struct comparing *c = comparing_of(call);
    size_t bytes;
    const char *text = body_json(&call->body, &bytes);
    if (call->exchange->query && *call->exchange->query) {
        pen_fail(
            error, PEN_MALFORMED, "", "A comparison is all in its body: there can be no query.");
        return STEP_FAILED;
    }
    if (!pen_compare_from_json(text, bytes, call->service->catalogue, AUTO_NAME, &c->asked, error))
        return STEP_FAILED;
    for (uint32_t i = 0; i <= c->asked.count; i++)
        memcpy(c->asked.requests[i].scene, call->address.id, PEN_ID_BYTES);
    c->events = accept_form(http_header(call->exchange, "Accept")) == ACCEPT_EVENTS;
    return STEP_NEXT;
}

static enum step_end look_up(struct call *call, struct pen_error *error)
{
    return routes_check_store(call, &comparing_of(call)->asked.requests[0], error) ? STEP_NEXT
                                                                                   : STEP_FAILED;
}

static enum step_end hand_over(struct call *call, struct pen_error *error)
{
    size_t bytes;
    const char *text = body_json(&call->body, &bytes);
    return routes_wants_job(call) && !comparing_of(call)->events
               ? routes_answer_job(call, JOB_COMPARE, text, bytes, error)
               : STEP_NEXT;
}

/* ---- the measurement's side: any thread ---- */

/* Under the lock: there is something to send. */
static void wake(struct comparing *c)
{
    if (!c->asleep)
        return;
    c->asleep = false;
    http_wake(c->call->exchange);
}

static bool is_gone(void *owner)
{
    struct comparing *c = owner;
    pthread_mutex_lock(&c->lock);
    bool gone = !c->call || http_client_is_gone(c->call->exchange);
    if (!gone && c->asleep && clock_now_ns() - c->slept_ns > KEEP_ALIVE_NS) {
        c->keep_alive = true;
        wake(c);
    }
    pthread_mutex_unlock(&c->lock);
    return gone;
}

/* Says that `ready` rows are there; the call goes on when that is what it waits for. */
static void note(
    struct comparing *c, struct compare *compare, uint32_t ready, const struct pen_error *end)
{
    struct call *resumes = NULL;
    pthread_mutex_lock(&c->lock);
    c->compare = compare;
    c->ready = ready;
    c->over = end != NULL;
    if (end)
        c->failure = *end;
    if (c->call && !c->resumed && (c->events || end)) {
        resumes = c->call;
        c->resumed = true;
    } else if (c->call)
        wake(c);
    pthread_mutex_unlock(&c->lock);
    if (resumes)
        call_resume(resumes, end);
}

/* Before every request but the first: those before it are done. */
static bool goes_on(void *owner, struct compare *compare, uint32_t request)
{
    note(owner, compare, request, NULL);
    return true;
}

static void done(void *owner, struct compare *compare, const struct pen_error *error)
{
    struct comparing *c = owner;
    struct pen_error late = {0};
    uint32_t count = 1 + c->asked.count;
    if (error->code == PEN_DEADLINE) {
        pen_fail(&late, PEN_DEADLINE, "/deadline_ms",
            "The comparison was not done in time: %u of %u images were. Allow more time, or "
            "compare fewer methods or smaller images.",
            compare_done_count(compare), count);
        error = &late;
    }
    note(c, compare, error->code == PEN_OK ? count : compare_done_count(compare), error);
    release(c);
}

/* Waits for the last of the renders; of events, for the first. */
static enum step_end measure(struct call *call, struct pen_error *error)
{
    struct handle *work = call->work;
    struct comparing *c = work->comparing;
    struct compare_plan plan = {.requests = c->asked.requests,
        .count = 1 + c->asked.count,
        .client = call->client,
        .deadline_ns =
            call->exchange->body_ns + c->asked.requests[0].delivery.deadline_ms * CLOCK_MS,
        .wants = goes_on,
        .is_gone = is_gone,
        .done = done,
        .owner = c};
    work->holds_share = true; /* before another thread can complete the call */
    c->references++;
    http_defer(call->exchange);
    if (compare_start(call->service->scheduler, &plan, error))
        return STEP_OVER;
    c->references--;
    work->holds_share = false;
    return STEP_FAILED;
}

/* ---- the answer ---- */

static struct compared_extra extra_of(const struct call *call)
{
    const struct service *s = call->service;
    return (struct compared_extra){.catalogue = s->catalogue,
        .cache = s->cache,
        .request_id = call->exchange->request_id,
        .total_ms = clock_ms(clock_now_ns() - call->exchange->body_ns)};
}

static char *whole(struct call *call)
{
    struct comparing *c = comparing_of(call);
    const struct compare_row *rows = compare_rows(c->compare);
    struct compared_extra extra = extra_of(call);
    for (uint32_t i = 0; i <= c->asked.count; i++)
        for (int stage = PEN_STAGE_LOAD; stage < PEN_STAGES; stage++)
            call->note.render_ms += rows[i].result.stage_ms[stage];
    return compared_document(&c->asked, rows, &extra);
}

/* Takes the data. */
static void put(struct comparing *c, const char *event, char *data)
{
    data = pen_json_put_links(data, c->call->prefix);
    int bytes = asprintf(&c->text, "event: %s\ndata: %s\n\n", event, data);
    if (bytes < 0)
        abort();
    c->bytes = (size_t)bytes;
    free(data);
}

/* Puts what comes next; false, and asleep, when there is nothing yet. */
static bool put_next(struct comparing *c)
{
    struct call *call = c->call; /* stays while its answer is sent */
    pthread_mutex_lock(&c->lock);
    bool failed = c->failure.code != PEN_OK, keep_alive = c->keep_alive, over = c->over;
    bool has_row = c->sent < c->ready;
    c->keep_alive = false;
    if (!has_row && !over && !keep_alive) {
        c->asleep = true;
        c->slept_ns = clock_now_ns();
        http_sleep(call->exchange);
    }
    pthread_mutex_unlock(&c->lock);
    if (has_row) {
        struct compared_extra extra = extra_of(call);
        put(c, c->sent ? "method" : "reference",
            compared_row(&c->asked, compare_rows(c->compare), c->sent, &extra));
        c->sent++;
    } else if (over) {
        put(c, failed ? "problem" : "done", failed ? call_problem(call, &c->failure) : whole(call));
        c->ended = true;
    } else if (keep_alive) {
        c->text = strdup(": still at work\n\n");
        c->bytes = strlen(c->text);
    } else
        return false;
    return true;
}

static int64_t read_events(void *owner, void *to, size_t most)
{
    struct comparing *c = owner;
    while (c->at == c->bytes) {
        free(c->text);
        c->text = NULL;
        c->bytes = c->at = 0;
        if (c->ended)
            return HTTP_STREAM_OVER;
        if (!put_next(c))
            return 0;
    }
    size_t bytes = c->bytes - c->at < most ? c->bytes - c->at : most;
    memcpy(to, c->text + c->at, bytes);
    c->at += bytes;
    return (int64_t)bytes;
}

static enum step_end answer(struct call *call, struct pen_error *error)
{
    (void)error;
    struct comparing *c = comparing_of(call);
    struct http_exchange *x = call->exchange;
    http_add_header(x, "Vary", "Accept");
    if (!c->events) {
        http_add_header(x, "Cache-Control", "no-store");
        call_json(call, 200, whole(call));
        return STEP_OVER;
    }
    http_add_header(x, "Cache-Control", "no-store, no-transform");
    http_add_header(x, "X-Accel-Buffering", "no"); /* proxies pass each event on at once */
    http_answer_stream(x, 200, accept_form_mime[ACCEPT_EVENTS],
        (struct http_stream){.read = read_events, .owner = c});
    return STEP_OVER;
}

static void end_comparing(struct call *call, void *given)
{
    struct handle *work = given;
    struct comparing *c = work->comparing;
    if (work->holds_share)
        scheduler_release(call->service->scheduler, call->client);
    pthread_mutex_lock(&c->lock);
    c->call = NULL;
    pthread_mutex_unlock(&c->lock);
    release(c);
}

static const struct step steps[] = {
    {"read", read_body},
    {"look up", look_up},              /* the scene, and the images of its lights */
    {"recall key", routes_recall_key}, /* what this was asked for before as */
    {"hand over", hand_over},          /* to a job, when the client does not wait; answers */
    {"measure", measure},              /* waits */
    {"answer", answer},
};

bool route_compare(struct call *call, struct pen_error *error)
{
    struct handle *work = call_work(call, sizeof(struct handle), end_comparing);
    work->comparing = pen_alloc_zero(1, sizeof *work->comparing);
    work->comparing->references = 1;
    work->comparing->call = call;
    pthread_mutex_init(&work->comparing->lock, NULL);
    return call_run(call, steps, error);
}
