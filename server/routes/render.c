/* Render requests, from the cache or from a worker, and finished results. */
#include "protocol/json_request.h"
#include "protocol/json_result.h"
#include "server/http/accept.h"
#include "server/auto/choice.h"
#include "server/base/clock.h"
#include "server/base/container.h"
#include "server/routes/routes.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool is_gone(struct waiter *waiter)
{
    struct call *call = container_of(waiter, struct call, waiter);
    return http_client_is_gone(call->exchange);
}

static void release_picture(void *picture)
{
    picture_release(picture);
}

/* The picture's own headers; `total_ms` counts from the last byte of the request. */
static void add_picture_headers(struct call *call, const struct picture *picture, double total_ms)
{
    struct http_exchange *x = call->exchange;
    char timing[560];
    if (call->is_cached)
        snprintf(timing, sizeof timing, "cache;desc=\"hit\", total;dur=%.3f", total_ms);
    else
        pen_server_timing(&picture->result, total_ms, timing, sizeof timing);
    http_add_header(x, "Server-Timing", "%s", timing);
    http_add_header(x, "Vary", "Accept");
    http_add_header(x, "Cache-Control", "no-cache"); /* keep it, but ask: a restart may change it */
    if (*call->choice)
        http_add_header(x, "X-Penumbra-Choice", "%s", call->choice);
    if (*call->choice && !call->choice_met)
        http_add_header(x, "X-Penumbra-Warning", "%s", call->choice);
    for (uint32_t i = 0; i < picture->result.warning_count && i < 3; i++)
        http_add_header(x, "X-Penumbra-Warning", "%s", picture->result.warnings[i]);
}

static void answer_picture(struct call *call, struct picture *picture)
{
    struct service *s = call->service;
    struct http_exchange *x = call->exchange;
    double total_ms = clock_ms(clock_now_ns() - x->body_ns);
    char href[PEN_ID_HEX + 16];
    snprintf(href, sizeof href, "/v1/results/%s", picture->tag);
    call->render_ms = 0;
    for (int stage = PEN_STAGE_LOAD; stage < PEN_STAGES; stage++)
        call->render_ms += picture->result.stage_ms[stage];
    if (!call->is_cached && total_ms >= call->render_ms)
        metrics_overhead(s->metrics, total_ms - call->render_ms - call->queue_ms);
    add_picture_headers(call, picture, total_ms);
    if (call->wants_record) {
        bool kept = picture_cost(picture) <= s->config->result_cache.bytes;
        struct pen_record_extra extra = {.request_id = x->request_id,
            .image_href = kept ? href : NULL,
            .etag = picture->tag,
            .total_ms = total_ms,
            .from_cache = call->is_cached,
            .choice = *call->choice ? call->choice : NULL,
            .choice_met = call->choice_met};
        routes_json(call, 200, pen_result_json(&picture->result, &extra, s->catalogue));
        return;
    }
    http_add_header(x, "Content-Location", "%s", href);
    if (routes_not_modified(call, picture->tag))
        return;
    struct http_body body = {
        picture->data, picture->size, release_picture, picture_reference(picture)};
    http_answer(x, 200, pen_format_mime[picture->result.completed.output.format], body);
}

/* Any thread. */
static void finish(struct waiter *waiter, const struct outcome *outcome)
{
    struct call *call = container_of(waiter, struct call, waiter);
    call->queue_ms = outcome->queue_ms;
    if (*call->choice && outcome->error.code == PEN_OK)
        auto_runs_observe(call->service->auto_runs, call, outcome->run_ms);
    if (outcome->error.code != PEN_OK)
        routes_fail(call, &outcome->error);
    else
        answer_picture(call, outcome->picture);
}

/* The request struct, from the query or the body. */
static bool read_request(struct call *call, struct pen_error *error)
{
    const struct pen_catalogue *catalogue = call->service->catalogue;
    if (call->route == PEN_ROUTE_RENDER_POST) {
        if (call->exchange->query && *call->exchange->query)
            return pen_fail(error, PEN_MALFORMED, "",
                "A posted render request is all in its body: there can be no query.");
        const char *text = call->text_bytes ? call->text : "{}";
        return pen_request_from_json(
            text, call->text_bytes ? call->text_bytes : 2, catalogue, &call->request, error);
    }
    struct pen_query_pair pairs[ROUTES_MAX_PAIRS];
    uint32_t count;
    return routes_split_query(call->exchange->query, pairs, &count, error) &&
           pen_request_from_query(pairs, count, catalogue, &call->request, error);
}

/* Lets Accept choose the format when the request left it at its default. */
static bool negotiate(struct call *call, struct pen_error *error)
{
    const char *accept = http_header(call->exchange, "Accept");
    struct pen_output *output = &call->request.output;
    call->wants_record = accept_record(accept);
    if (call->wants_record || accept_allows(accept, pen_format_mime[output->format]))
        return true;
    bool is_default = output->format == PEN_PNG;
    for (uint32_t f = 0; is_default && f < PEN_FORMATS; f++) {
        if (!accept_allows(accept, pen_format_mime[f]))
            continue;
        struct pen_error fault = {0};
        output->format = f;
        if (pen_request_check(&call->request, call->service->catalogue, &fault))
            return true;
        output->format = PEN_PNG;
    }
    return pen_fail(error, PEN_NOT_ACCEPTABLE, "/output/format",
        "The image is %s, which Accept does not allow.", pen_format_mime[output->format]);
}

bool routes_check_store(struct call *call, struct pen_error *error)
{
    struct service *s = call->service;
    struct store_entry entry;
    if (!scene_store_find(s->store, STORE_SCENES, call->id, &entry))
        return pen_fail(error, PEN_NOT_FOUND, "", "There is no such scene.");
    if (entry.stale)
        return pen_fail(error, PEN_UNAVAILABLE, "", "The scene is being imported again.");
    for (uint32_t i = 0; i < call->request.light_count; i++) {
        const struct pen_light *light = &call->request.lights[i];
        char pointer[40];
        snprintf(pointer, sizeof pointer, "/lights/%u/texture/image", i);
        if (light->texture == PEN_TEXTURE_IMAGE &&
            !scene_store_find(s->store, STORE_IMAGES, light->image, NULL))
            return pen_fail(error, PEN_INVALID, pointer, "There is no such image.");
    }
    uint32_t refused_s = worker_pool_quarantine_s(s->pool, call->id);
    if (refused_s)
        return pen_fail(error, PEN_INVALID, "",
            "Rendering this scene ended the renderer twice: it is refused for %u more seconds.",
            refused_s);
    return true;
}

/* Caches may be passed by: Cache-Control: no-cache renders anew. */
static bool wants_fresh(const struct call *call)
{
    const char *control = http_header(call->exchange, "Cache-Control");
    return control && strstr(control, "no-cache");
}

void routes_render(struct call *call)
{
    struct pen_error error = {0};
    if (!read_request(call, &error) || !negotiate(call, &error)) {
        routes_fail(call, &error);
        return;
    }
    memcpy(call->request.scene, call->id, PEN_ID_BYTES);
    if (!routes_check_store(call, &error)) {
        routes_fail(call, &error);
        return;
    }
    if (!strcmp(call->request.technique, AUTO_NAME))
        routes_auto(call);
    else
        routes_serve(call);
}

void routes_serve(struct call *call)
{
    struct service *s = call->service;
    struct pen_error error = {0};
    struct pen_device_info device;
    call->technique = pen_catalogue_find(s->catalogue, call->request.technique)->name;
    bool fresh = wants_fresh(call);
    if (!fresh && service_device(s, &device)) {
        char tag[PEN_ID_HEX + 1];
        picture_tag(&call->request, &device, tag);
        const char *known = http_header(call->exchange, "If-None-Match");
        if (!call->wants_record && known && strstr(known, tag)) {
            http_add_header(call->exchange, "Vary", "Accept");
            routes_not_modified(call, tag);
            return;
        }
        struct picture *picture = result_cache_get(s->cache, tag);
        if (picture) {
            call->is_cached = true;
            answer_picture(call, picture);
            picture_release(picture);
            return;
        }
    }
    uint8_t key[PEN_ID_BYTES];
    picture_key(&call->request, key);
    call->waiter.client = call->client;
    call->waiter.deadline_ns =
        call->exchange->body_ns + call->request.delivery.deadline_ms * CLOCK_MS;
    call->waiter.is_gone = is_gone;
    call->waiter.finish = finish;
    call->holds_share = true; /* before another thread can complete the call */
    if (!call->is_deferred)
        http_defer(call->exchange);
    if (!scheduler_submit(s->scheduler, &call->request, key, !fresh, &call->waiter, &error)) {
        call->holds_share = false;
        routes_fail(call, &error);
    }
}

void routes_result(struct call *call)
{
    char tag[PEN_ID_HEX + 1];
    pen_id_to_hex(call->id, tag);
    struct picture *picture = result_cache_get(call->service->cache, tag);
    if (!picture) {
        struct pen_error error = {0};
        pen_fail(&error, PEN_NOT_FOUND, "", "The result is not kept any more: render it again.");
        routes_fail(call, &error);
        return;
    }
    call->is_cached = true;
    http_add_header(call->exchange, "Cache-Control", "public, max-age=31536000, immutable");
    if (!routes_not_modified(call, tag)) {
        struct http_body body = {
            picture->data, picture->size, release_picture, picture_reference(picture)};
        http_answer(
            call->exchange, 200, pen_format_mime[picture->result.completed.output.format], body);
    }
    picture_release(picture);
}
