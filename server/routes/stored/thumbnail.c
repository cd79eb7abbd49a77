/* GET /v1/scenes/{id}/thumbnail: what is kept, or a render that is kept from then on. */
#include "server/gallery/thumbnails.h"
#include "protocol/container.h"
#include "protocol/memory.h"
#include "server/base/clock.h"
#include "server/base/hash.h"
#include "server/base/log.h"
#include "server/routes/routes.h"
#include <stdlib.h>
#include <string.h>

struct thumbnail {
    struct call *call;
    struct pen_request request;
    struct waiter waiter;
    struct picture *picture; /* once it is made */
    bool holds_share;
};

static bool send_image(struct call *call, char *data, size_t bytes)
{
    char tag[PEN_ID_HEX + 1];
    uint8_t digest[PEN_ID_BYTES];
    struct hash *hash = hash_create();
    hash_add(hash, data, bytes);
    hash_finish(hash, digest);
    pen_id_to_hex(digest, tag);
    http_add_header(call->exchange, "Cache-Control", "no-cache");
    if (call_not_modified(call, tag))
        free(data);
    else
        http_answer(call->exchange, 200, pen_format_mime[PEN_JPEG],
            (struct http_body){data, bytes, free, data});
    return true;
}

static bool is_gone(struct waiter *waiter)
{
    return http_client_is_gone(container_of(waiter, struct thumbnail, waiter)->call->exchange);
}

/* Any thread. */
static void finish(struct waiter *waiter, const struct outcome *outcome)
{
    struct thumbnail *work = container_of(waiter, struct thumbnail, waiter);
    if (outcome->error.code == PEN_OK)
        work->picture = picture_reference(outcome->picture);
    call_resume(work->call, &outcome->error);
}

static enum step_end recall(struct call *call, struct pen_error *error)
{
    const struct thumbnail *work = call->work;
    struct service *s = call->service;
    size_t bytes;
    if (!routes_check_store(call, &work->request, error))
        return STEP_FAILED;
    char *data = thumbnail_read(s->store, work->request.scene, &bytes);
    call->note.cached = data != NULL;
    if (!data)
        return STEP_NEXT;
    send_image(call, data, bytes);
    return STEP_OVER;
}

static enum step_end queue(struct call *call, struct pen_error *error)
{
    struct thumbnail *work = call->work;
    uint8_t key[PEN_ID_BYTES];
    picture_key(&work->request, key);
    work->waiter = (struct waiter){.client = call->client,
        .request_id = call->exchange->request_id,
        .deadline_ns = call->exchange->body_ns + work->request.delivery.deadline_ms * CLOCK_MS,
        .is_gone = is_gone,
        .finish = finish};
    work->holds_share = true; /* before another thread can complete the call */
    http_defer(call->exchange);
    if (scheduler_submit(call->service->scheduler, &work->request, key, true, &work->waiter, error))
        return STEP_OVER;
    work->holds_share = false;
    return STEP_FAILED;
}

static enum step_end answer(struct call *call, struct pen_error *error)
{
    const struct thumbnail *work = call->work;
    const struct picture *picture = work->picture;
    struct pen_error fault = {0};
    (void)error;
    char *data = pen_alloc(picture->size, 1);
    memcpy(data, picture->data, picture->size);
    if (picture->result.progress.done >= picture->result.progress.total &&
        !thumbnail_keep(call->service->store, work->request.scene, data, picture->size, &fault))
        log_event(LOG_INFO, "a thumbnail is not kept: %s", fault.message);
    send_image(call, data, picture->size);
    return STEP_OVER;
}

static void end_work(struct call *call, void *given)
{
    struct thumbnail *work = given;
    if (work->holds_share)
        scheduler_release(call->service->scheduler, call->client);
    picture_release(work->picture);
}

static const struct step steps[] = {
    {"recall", recall}, /* answers when it is there */
    {"queue", queue},   /* waits for a worker */
    {"answer", answer},
};

bool route_thumbnail(struct call *call, struct pen_error *error)
{
    struct thumbnail *work = call_work(call, sizeof *work, end_work);
    work->call = call;
    thumbnail_request(&work->request, call->address.id, call->service->catalogue);
    return call_run(call, steps, error);
}
