/* Methods against a reference. */
#include "server/queue/compare.h"
#include "protocol/json_compare.h"
#include "server/auto/choice.h"
#include "server/base/clock.h"
#include "server/jobs/compared.h"
#include "server/routes/routes.h"
#include <stdio.h>
#include <string.h>

struct comparing {
    struct pen_compare asked;
    struct compare *compare; /* when it is done */
    bool holds_share;
};

static enum step_end read_body(struct call *call, struct pen_error *error)
{
    struct comparing *work = call->work;
    size_t bytes;
    const char *text = body_json(&call->body, &bytes);
    if (call->exchange->query && *call->exchange->query) {
        pen_fail(
            error, PEN_MALFORMED, "", "A comparison is all in its body: there can be no query.");
        return STEP_FAILED;
    }
    if (!pen_compare_from_json(
            text, bytes, call->service->catalogue, AUTO_NAME, &work->asked, error))
        return STEP_FAILED;
    for (uint32_t i = 0; i <= work->asked.count; i++)
        memcpy(work->asked.requests[i].scene, call->address.id, PEN_ID_BYTES);
    return STEP_NEXT;
}

static enum step_end look_up(struct call *call, struct pen_error *error)
{
    const struct comparing *work = call->work;
    return routes_check_store(call, &work->asked.requests[0], error) ? STEP_NEXT : STEP_FAILED;
}

static enum step_end hand_over(struct call *call, struct pen_error *error)
{
    size_t bytes;
    const char *text = body_json(&call->body, &bytes);
    return routes_wants_job(call) ? routes_answer_job(call, JOB_COMPARE, text, bytes, error)
                                  : STEP_NEXT;
}

static bool is_gone(void *owner)
{
    return http_client_is_gone(((struct call *)owner)->exchange);
}

/* Any thread. */
static void done(void *owner, struct compare *compare, const struct pen_error *error)
{
    struct call *call = owner;
    struct comparing *work = call->work;
    struct pen_error late = {0};
    work->compare = compare;
    if (error->code == PEN_DEADLINE) {
        pen_fail(&late, PEN_DEADLINE, "/deadline_ms",
            "The comparison was not done in time: %u of %u images were. Allow more time, or "
            "compare fewer methods or smaller images.",
            compare_done_count(compare), 1 + work->asked.count);
        error = &late;
    }
    call_resume(call, error);
}

/* Waits for the last of the renders. */
static enum step_end measure(struct call *call, struct pen_error *error)
{
    struct comparing *work = call->work;
    const struct pen_request *first = &work->asked.requests[0];
    struct compare_plan plan = {.requests = work->asked.requests,
        .count = 1 + work->asked.count,
        .client = call->client,
        .deadline_ns = call->exchange->body_ns + first->delivery.deadline_ms * CLOCK_MS,
        .is_gone = is_gone,
        .done = done,
        .owner = call};
    work->holds_share = true; /* before another thread can complete the call */
    http_defer(call->exchange);
    if (compare_start(call->service->scheduler, &plan, error))
        return STEP_OVER;
    work->holds_share = false;
    return STEP_FAILED;
}

static enum step_end answer(struct call *call, struct pen_error *error)
{
    (void)error;
    struct service *s = call->service;
    struct comparing *work = call->work;
    const struct compare_row *rows = compare_rows(work->compare);
    uint32_t count = 1 + work->asked.count;
    for (uint32_t i = 0; i < count; i++)
        for (int stage = PEN_STAGE_LOAD; stage < PEN_STAGES; stage++)
            call->note.render_ms += rows[i].result.stage_ms[stage];
    struct compared_extra extra = {.catalogue = s->catalogue,
        .cache = s->cache,
        .request_id = call->exchange->request_id,
        .total_ms = clock_ms(clock_now_ns() - call->exchange->body_ns)};
    char *text = compared_document(&work->asked, rows, &extra);
    http_add_header(call->exchange, "Cache-Control", "no-store");
    call_json(call, 200, text);
    return STEP_OVER;
}

static void end_comparing(struct call *call, void *given)
{
    struct comparing *work = given;
    if (work->holds_share)
        scheduler_release(call->service->scheduler, call->client);
    compare_destroy(work->compare);
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
    call_work(call, sizeof(struct comparing), end_comparing);
    return call_run(call, steps, error);
}
