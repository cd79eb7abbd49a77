/* Render requests, from the cache or from a worker, and finished results. */
#include "protocol/json_request.h"
#include "protocol/json_result.h"
#include "server/auto/choice.h"
#include "server/base/clock.h"
#include "protocol/container.h"
#include "server/http/accept.h"
#include "server/http/query.h"
#include "server/routes/parts.h"
#include "server/routes/routes.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct rendering {
    struct call *call;
    struct pen_request request;
    struct auto_render choice; /* choice.why "": the method was given */
    struct waiter waiter;
    struct picture *picture; /* when there is one */
    struct parts *parts;     /* when the answer gets better */
    enum accept_form form;
    bool holds_share, is_deferred;
    bool is_stateful; /* see pen_request_is_stateful */
};

/* ---- what is asked ---- */

static enum step_end read_request(struct call *call, struct pen_error *error)
{
    struct rendering *work = call->work;
    const struct pen_catalogue *catalogue = call->service->catalogue;
    char *query = call->exchange->query;
    bool ok;
    if (call->address.route->flags & PEN_ROUTE_QUERY) {
        struct pen_query_pair pairs[HTTP_MAX_PAIRS];
        uint32_t count;
        ok = http_split_query(query, pairs, &count, error) &&
             pen_request_from_query(pairs, count, catalogue, &work->request, error);
    } else if (query && *query) {
        ok = pen_fail(error, PEN_MALFORMED, "",
            "A posted render request is all in its body: there can be no query.");
    } else {
        size_t bytes;
        const char *text = body_json(&call->body, &bytes);
        ok = pen_request_from_json(text, bytes, catalogue, &work->request, error);
    }
    memcpy(work->request.scene, call->address.id, PEN_ID_BYTES);
    return ok ? STEP_NEXT : STEP_FAILED;
}

/* Lets Accept choose the form, and the format when the request left it at its default. */
static enum step_end negotiate(struct call *call, struct pen_error *error)
{
    struct rendering *work = call->work;
    const char *accept = http_header(call->exchange, "Accept");
    struct pen_output *output = &work->request.output;
    work->form = accept_form(accept);
    if (work->form == ACCEPT_PICTURE && work->request.delivery.progressive.on)
        work->form = ACCEPT_PARTS;
    if (work->form == ACCEPT_RECORD || accept_allows(accept, pen_format_mime[output->format]))
        return STEP_NEXT;
    bool is_default = output->format == PEN_PNG;
    for (uint32_t f = 0; is_default && f < PEN_FORMATS; f++) {
        if (!accept_allows(accept, pen_format_mime[f]))
            continue;
        struct pen_error fault = {0};
        output->format = f;
        if (pen_request_check(&work->request, call->service->catalogue, &fault))
            return STEP_NEXT;
        output->format = PEN_PNG;
    }
    if (work->form != ACCEPT_PICTURE) /* whatever the parts are */
        return STEP_NEXT;
    pen_fail(error, PEN_NOT_ACCEPTABLE, "/output/format",
        "The image is %s, which Accept does not allow.", pen_format_mime[output->format]);
    return STEP_FAILED;
}

bool routes_check_store(
    struct call *call, const struct pen_request *request, struct pen_error *error)
{
    struct service *s = call->service;
    if (!scene_store_is_ready(s->store, STORE_SCENES, request->scene, error))
        return false;
    for (uint32_t i = 0; i < request->light_count; i++) {
        const struct pen_light *light = &request->lights[i];
        char pointer[40];
        snprintf(pointer, sizeof pointer, "/lights/%u/texture/image", i);
        if (light->texture == PEN_TEXTURE_IMAGE &&
            !scene_store_find(s->store, STORE_IMAGES, light->image, NULL))
            return pen_fail(error, PEN_INVALID, pointer, "There is no such image.");
    }
    uint32_t held_s;
    enum quarantined held = worker_pool_quarantined(s->pool, request, &held_s);
    if (!held)
        return true;
    pen_fail(error, PEN_HELD_BACK, "",
        held == QUARANTINE_SCENE
            ? "Rendering this scene ended the renderer several times: it is refused for %u more "
              "seconds."
            : "Rendering this scene with this method at this size ended the renderer twice: that "
              "is "
              "refused for %u more seconds. Other methods or sizes may do.",
        held_s);
    error->retry_after_s = held_s;
    return false;
}

static enum step_end look_up(struct call *call, struct pen_error *error)
{
    const struct rendering *work = call->work;
    return routes_check_store(call, &work->request, error) ? STEP_NEXT : STEP_FAILED;
}

/* ---- a job, when the client does not wait ---- */

/* What depends on the client's waiting, or on what came before it, is answered at once. */
static enum step_end hand_over(struct call *call, struct pen_error *error)
{
    struct rendering *work = call->work;
    const struct pen_catalogue *catalogue = call->service->catalogue;
    bool waits = work->form == ACCEPT_PARTS || work->form == ACCEPT_EVENTS ||
                 !strcmp(work->request.technique, AUTO_NAME) ||
                 pen_request_is_stateful(&work->request, catalogue);
    if (waits || !routes_wants_job(call))
        return STEP_NEXT;
    char *body = pen_request_json(&work->request, catalogue); /* as negotiated */
    enum step_end end = routes_answer_job(call, JOB_RENDER, body, strlen(body), error);
    free(body);
    return end;
}

/* ---- the method, when it is left open ---- */

/* The device, once a worker has told. */
static bool read_device(struct service *s, struct pen_device_info *device)
{
    struct worker_pool_numbers numbers;
    worker_pool_read(s->pool, &numbers);
    *device = numbers.device;
    return numbers.has_device;
}

/* Any thread. */
static void chosen(struct auto_render *choice, const struct pen_error *error)
{
    struct rendering *work = container_of(choice, struct rendering, choice);
    call_resume(work->call, error);
}

/* Waits when the scene must be measured first. */
static enum step_end choose(struct call *call, struct pen_error *error)
{
    struct rendering *work = call->work;
    struct auto_runs *runs = call->service->auto_runs;
    struct pen_device_info device;
    if (strcmp(work->request.technique, AUTO_NAME))
        return STEP_NEXT;
    if (!read_device(call->service, &device)) {
        pen_fail(error, PEN_UNAVAILABLE, "", "The worker is still starting.");
        return STEP_FAILED;
    }
    work->choice.request = &work->request;
    work->choice.deadline_ns =
        call->exchange->body_ns + work->request.delivery.deadline_ms * CLOCK_MS;
    work->choice.chosen = chosen;
    if (auto_runs_recall(runs, &device, &work->choice, error))
        return STEP_NEXT;
    if (error->code != PEN_OK)
        return STEP_FAILED;
    work->is_deferred = true;
    http_defer(call->exchange);
    return auto_runs_measure(runs, &device, &work->choice, error) ? STEP_OVER : STEP_FAILED;
}

/* ---- the picture ---- */

/* Caches may be passed by: Cache-Control: no-cache renders anew. */
static bool wants_fresh(const struct call *call)
{
    const char *control = http_header(call->exchange, "Cache-Control");
    return control && strstr(control, "no-cache");
}

static enum step_end recall(struct call *call, struct pen_error *error)
{
    (void)error;
    struct service *s = call->service;
    struct rendering *work = call->work;
    struct pen_device_info device;
    char tag[PEN_ID_HEX + 1];
    call->note.technique = pen_catalogue_find(s->catalogue, work->request.technique)->name;
    work->is_stateful = pen_request_is_stateful(&work->request, s->catalogue);
    if (!work->is_stateful) /* the method does not look at it */
        memset(work->request.delivery.session, 0, sizeof work->request.delivery.session);
    if (wants_fresh(call) || work->is_stateful || !read_device(s, &device))
        return STEP_NEXT;
    picture_tag(&work->request, &device, tag);
    if (work->form != ACCEPT_RECORD && work->form != ACCEPT_EVENTS && call_knows(call, tag)) {
        http_add_header(call->exchange, "Vary", "Accept");
        call_not_modified(call, tag);
        return STEP_OVER;
    }
    work->picture = result_cache_get(s->cache, tag);
    call->note.cached = work->picture != NULL;
    return STEP_NEXT;
}

static void note_times(struct call *call, const struct pen_result *result)
{
    for (int stage = PEN_STAGE_LOAD; stage < PEN_STAGES; stage++)
        call->note.render_ms += result->stage_ms[stage];
}

static struct rendering *rendering_of(struct waiter *waiter)
{
    return container_of(waiter, struct rendering, waiter);
}

static bool is_gone(struct waiter *waiter)
{
    return http_client_is_gone(rendering_of(waiter)->call->exchange);
}

/* Any thread. */
static void ended(struct call *call, const struct outcome *outcome)
{
    struct rendering *work = call->work;
    call->note.queue_ms = outcome->queue_ms;
    if (outcome->error.code != PEN_OK)
        return;
    work->picture = picture_reference(outcome->picture);
    note_times(call, &work->picture->result);
    if (*work->choice.why && !work->picture->result.progress.kept)
        auto_runs_observe(call->service->auto_runs, &work->choice, outcome->run_ms);
}

/* Any thread. */
static void finish(struct waiter *waiter, const struct outcome *outcome)
{
    struct call *call = rendering_of(waiter)->call;
    ended(call, outcome);
    call_resume(call, &outcome->error);
}

/* Waits for a worker, or for its first picture when it gets better. */
static enum step_end queue(struct call *call, struct pen_error *error)
{
    struct rendering *work = call->work;
    uint8_t key[PEN_ID_BYTES];
    if (work->form == ACCEPT_PARTS || work->form == ACCEPT_EVENTS)
        work->parts = parts_create(&(struct parts_config){
            .call = call, .form = work->form, .choice = &work->choice, .ended = ended});
    if (work->picture) {
        if (work->parts)
            parts_give(work->parts, work->picture);
        note_times(call, &work->picture->result);
        return STEP_NEXT;
    }
    picture_key(&work->request, key);
    work->waiter = (struct waiter){.client = call->client,
        .request_id = call->exchange->request_id,
        .deadline_ns = call->exchange->body_ns + work->request.delivery.deadline_ms * CLOCK_MS,
        .fresh = wants_fresh(call),
        .best = work->request.delivery.on_deadline == PEN_DEADLINE_BEST,
        .is_gone = is_gone,
        .finish = finish};
    /* What may end early suits nobody else. */
    bool shareable = !wants_fresh(call) && !work->is_stateful &&
                     !pen_delivery_is_limited(&work->request.delivery);
    work->holds_share = true; /* before another thread can complete the call */
    if (!work->is_deferred)
        http_defer(call->exchange);
    if (work->parts
            ? parts_submit(work->parts, &work->request, key, shareable, &work->waiter, error)
            : scheduler_submit(
                  call->service->scheduler, &work->request, key, shareable, &work->waiter, error))
        return STEP_OVER;
    work->holds_share = false;
    return STEP_FAILED;
}

/* ---- the answer ---- */

/* What was chosen, and what the method cannot do. */
static void add_warnings(struct call *call, const struct picture *picture)
{
    struct http_exchange *x = call->exchange;
    const struct rendering *work = call->work;
    const struct pen_result *result = &picture->result;
    const char *why = work->choice.why;
    if (*why)
        http_add_header(x, "X-Penumbra-Choice", "%s", why);
    if (*why && !work->choice.met)
        http_add_header(x, "X-Penumbra-Warning", "%s", why);
    for (uint32_t i = 0; i < result->warning_count && i < 3; i++)
        http_add_header(x, "X-Penumbra-Warning", "%s", result->warnings[i]);
}

/* The picture's own headers; `total_ms` counts from the last byte of the request. */
static void add_picture_headers(struct call *call, double total_ms)
{
    struct http_exchange *x = call->exchange;
    const struct rendering *work = call->work;
    const struct pen_result *result = &work->picture->result;
    char timing[560];
    if (call->note.cached)
        snprintf(timing, sizeof timing, "cache;desc=\"hit\", total;dur=%.3f", total_ms);
    else
        pen_server_timing(result, total_ms, timing, sizeof timing);
    http_add_header(x, "Server-Timing", "%s", timing);
    http_add_header(x, "Vary", "Accept");
    /* Keep it, but ask: a restart may change it. What had to end early comes out otherwise each time. */
    bool complete = result->progress.done >= result->progress.total;
    http_add_header(x, "Cache-Control", complete && !work->is_stateful ? "no-cache" : "no-store");
    if (work->is_stateful)
        http_add_header(x, "X-Penumbra-History", "frames=%u, share=%.4f", result->history_frames,
            (double)result->history_share);
    add_warnings(call, work->picture);
}

static void release_picture(void *picture)
{
    picture_release(picture);
}

static void send_picture(struct call *call, struct picture *picture)
{
    struct http_body body = {
        picture->data, picture->size, release_picture, picture_reference(picture)};
    http_answer(
        call->exchange, 200, pen_format_mime[picture->result.completed.output.format], body);
}

static enum step_end answer(struct call *call, struct pen_error *error)
{
    (void)error;
    struct service *s = call->service;
    struct http_exchange *x = call->exchange;
    struct rendering *work = call->work;
    struct picture *picture = work->picture;
    struct call_note *note = &call->note;
    double total_ms = clock_ms(clock_now_ns() - x->body_ns);
    char href[PEN_ID_HEX + 16];
    if (work->parts) {
        add_warnings(call, parts_first(work->parts));
        parts_answer(work->parts);
        return STEP_OVER;
    }
    snprintf(href, sizeof href, "/v1/results/%s", picture->tag);
    if (!note->cached && total_ms >= note->render_ms)
        metrics_overhead(s->metrics, total_ms - note->render_ms - note->queue_ms);
    add_picture_headers(call, total_ms);
    if (work->form == ACCEPT_RECORD) {
        bool kept = !work->is_stateful && picture_cost(picture) <= s->config->result_cache.bytes;
        struct pen_record_extra extra = {.request_id = x->request_id,
            .image_href = kept ? href : NULL,
            .etag = work->is_stateful ? NULL : picture->tag,
            .total_ms = total_ms,
            .from_cache = note->cached,
            .choice = *work->choice.why ? work->choice.why : NULL,
            .choice_met = work->choice.met};
        call_json(call, 200, pen_result_json(&picture->result, &extra, s->catalogue));
        return STEP_OVER;
    }
    if (work->is_stateful) {
        send_picture(call, picture);
        return STEP_OVER;
    }
    http_add_header(x, "Content-Location", "%s%s", call->prefix, href);
    if (!call_not_modified(call, picture->tag))
        send_picture(call, picture);
    return STEP_OVER;
}

static void end_rendering(struct call *call, void *given)
{
    struct rendering *work = given;
    if (work->holds_share)
        scheduler_release(call->service->scheduler, call->client);
    parts_leave(work->parts);
    picture_release(work->picture);
}

static const struct step steps[] = {
    {"read", read_request},            /* the query or the body */
    {"negotiate", negotiate},          /* the format, or the record, with Accept */
    {"look up", look_up},              /* the scene, and the images of its lights */
    {"recall key", routes_recall_key}, /* what this was asked for before as */
    {"hand over", hand_over},          /* to a job, when the client does not wait; answers */
    {"choose", choose}, /* the method, when it is left open; may wait for measurements */
    {"recall", recall}, /* the picture from the cache; answers when the client has it */
    {"queue", queue},   /* else waits for a worker */
    {"answer", answer},
};

static bool render(struct call *call, struct pen_error *error)
{
    struct rendering *work = call_work(call, sizeof *work, end_rendering);
    work->call = call;
    return call_run(call, steps, error);
}

bool route_render(struct call *call, struct pen_error *error)
{
    return render(call, error);
}

bool route_render_query(struct call *call, struct pen_error *error)
{
    return render(call, error);
}

bool route_result(struct call *call, struct pen_error *error)
{
    char tag[PEN_ID_HEX + 1];
    pen_id_to_hex(call->address.id, tag);
    struct picture *picture = result_cache_get(call->service->cache, tag);
    if (!picture)
        picture = result_cache_get(call->service->part_cache, tag);
    if (!picture)
        return pen_fail(
            error, PEN_NOT_FOUND, "", "The result is not kept any more: render it again.");
    call->note.cached = true;
    http_add_header(call->exchange, "Cache-Control", "public, max-age=31536000, immutable");
    if (!call_not_modified(call, tag))
        send_picture(call, picture);
    picture_release(picture);
    return true;
}
