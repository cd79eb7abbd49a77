/* Methods against a reference. */
#include "protocol/json_compare.h"
#include "protocol/memory.h"
#include "server/auto/choice.h"
#include "server/base/clock.h"
#include "server/queue/compare.h"
#include "server/routes/routes.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LINK_BYTES (PEN_ID_HEX + 16)

/* Keeps a picture and says where; NULL when there is none or it is too large to be kept. */
static const char *keep(struct service *s, struct picture *picture, char link[LINK_BYTES])
{
    if (!picture || !result_cache_put(s->cache, picture))
        return NULL;
    snprintf(link, LINK_BYTES, "/v1/results/%s", picture->tag);
    return link;
}

static void answer(struct call *call, struct compare *compare)
{
    struct service *s = call->service;
    const struct compare_row *rows = compare_rows(compare);
    uint32_t count = 1 + call->compare->count;
    struct pen_compared *out = pen_alloc_zero(count, sizeof *out);
    char(*links)[4][LINK_BYTES] = pen_alloc_zero(count, sizeof *links);
    for (uint32_t i = 0; i < count; i++) {
        out[i].result = &rows[i].result;
        out[i].image = keep(s, rows[i].image, links[i][0]);
        out[i].difference = keep(s, rows[i].maps[CHANNEL_DIFFERENCE], links[i][1]);
        out[i].ssim_map = keep(s, rows[i].maps[CHANNEL_SSIM], links[i][2]);
        out[i].flip_map = keep(s, rows[i].maps[CHANNEL_FLIP], links[i][3]);
        for (int stage = PEN_STAGE_LOAD; stage < PEN_STAGES; stage++)
            call->render_ms += rows[i].result.stage_ms[stage];
    }
    double total_ms = clock_ms(clock_now_ns() - call->exchange->body_ns);
    char *text =
        pen_compare_json(call->compare, out, call->exchange->request_id, total_ms, s->catalogue);
    free(links);
    free(out);
    http_add_header(call->exchange, "Cache-Control", "no-store");
    routes_json(call, 200, text);
}

/* Any thread. */
static void done(void *owner, struct compare *compare, const struct pen_error *error)
{
    struct call *call = owner;
    if (error->code == PEN_DEADLINE) {
        struct pen_error late = {0};
        pen_fail(&late, PEN_DEADLINE, "/deadline_ms",
            "The comparison was not done in time: %u of %u images were. Allow more time, or "
            "compare "
            "fewer methods or smaller images.",
            compare_done_count(compare), 1 + call->compare->count);
        routes_fail(call, &late);
    } else if (error->code != PEN_OK)
        routes_fail(call, error);
    else
        answer(call, compare);
    compare_destroy(compare);
}

static bool is_gone(void *owner)
{
    return http_client_is_gone(((struct call *)owner)->exchange);
}

static bool read_body(struct call *call, struct pen_error *error)
{
    const char *text = call->text_bytes ? call->text : "{}";
    if (call->exchange->query && *call->exchange->query)
        return pen_fail(
            error, PEN_MALFORMED, "", "A comparison is all in its body: there can be no query.");
    call->compare = pen_alloc(1, sizeof *call->compare);
    return pen_compare_from_json(text, call->text_bytes ? call->text_bytes : 2,
        call->service->catalogue, AUTO_NAME, call->compare, error);
}

void routes_compare(struct call *call)
{
    struct service *s = call->service;
    struct pen_error error = {0};
    if (!read_body(call, &error)) {
        routes_fail(call, &error);
        return;
    }
    struct pen_compare *compare = call->compare;
    for (uint32_t i = 0; i <= compare->count; i++)
        memcpy(compare->requests[i].scene, call->id, PEN_ID_BYTES);
    call->request = compare->requests[0];
    if (!routes_check_store(call, &error)) {
        routes_fail(call, &error);
        return;
    }
    struct compare_plan plan = {.requests = compare->requests,
        .count = 1 + compare->count,
        .client = call->client,
        .deadline_ns = call->exchange->body_ns + call->request.delivery.deadline_ms * CLOCK_MS,
        .is_gone = is_gone,
        .done = done,
        .owner = call};
    call->holds_share = true; /* before another thread can complete the call */
    http_defer(call->exchange);
    if (!compare_start(s->scheduler, &plan, &error)) {
        call->holds_share = false;
        routes_fail(call, &error);
    }
}
