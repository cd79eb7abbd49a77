#include "server/routes/parts.h"
#include "protocol/container.h"
#include "protocol/json_result.h"
#include "protocol/memory.h"
#include "server/base/clock.h"
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define KEEP_ALIVE_NS (15 * CLOCK_S) /* proxies close what is silent for longer */
#define HREF_BYTES (PEN_ID_HEX + 16)

struct piece {
    const void *data;
    size_t bytes;
};

struct parts {
    pthread_mutex_t lock; /* guards what follows, and is held while `ended` and http.h are called */
    uint32_t references;  /* the call's and the waiter's */
    struct call *call;    /* NULL: it has ended */
    bool resumed, asleep, is_last, keep_alive;
    struct picture *next;     /* to be sent */
    struct pen_error failure; /* of the render */
    uint32_t done;            /* samples in the last picture that was taken up */
    uint64_t slept_ns;
    /* Constant: */
    struct service *service;
    struct parts_config config;
    struct waiter waiter;
    /* Of the thread that sends: */
    struct picture *shown;
    char *before, *after;
    struct piece pieces[3];
    uint32_t piece;
    bool begun, over, broken;
};

/* ---- waiting ---- */

static void release(struct parts *p)
{
    pthread_mutex_lock(&p->lock);
    bool unused = --p->references == 0;
    pthread_mutex_unlock(&p->lock);
    if (!unused)
        return;
    picture_release(p->next);
    picture_release(p->shown);
    free(p->before);
    free(p->after);
    pthread_mutex_destroy(&p->lock);
    free(p);
}

static struct parts *parts_of(struct waiter *waiter)
{
    return container_of(waiter, struct parts, waiter);
}

/* Under the lock: there is something to send. */
static void wake(struct parts *p)
{
    if (!p->asleep)
        return;
    p->asleep = false;
    http_wake(p->call->exchange);
}

/* Asked now and then while the render runs. */
static bool is_gone(struct waiter *waiter)
{
    struct parts *p = parts_of(waiter);
    pthread_mutex_lock(&p->lock);
    bool gone = !p->call || http_client_is_gone(p->call->exchange);
    if (!gone && p->asleep && p->config.form == ACCEPT_EVENTS &&
        clock_now_ns() - p->slept_ns > KEEP_ALIVE_NS) {
        p->keep_alive = true;
        wake(p);
    }
    pthread_mutex_unlock(&p->lock);
    return gone;
}

/* Any thread. */
static void part(struct waiter *waiter, struct picture *picture)
{
    struct parts *p = parts_of(waiter);
    struct call *resumes = NULL;
    const struct pen_progress *progress = &picture->result.progress;
    pthread_mutex_lock(&p->lock);
    /* A render that had to begin again has less to show at first. */
    bool is_better = progress->done > p->done && !p->next;
    if (p->call && is_better) {
        p->done = progress->done;
        p->next = picture_reference(picture);
        if (!p->resumed)
            resumes = p->call;
        p->resumed = true;
        wake(p);
    }
    bool asks_again = p->call && !is_better;
    pthread_mutex_unlock(&p->lock);
    if (asks_again)
        scheduler_want_part(p->service->scheduler, waiter);
    if (resumes)
        call_resume(resumes, NULL);
}

/* Any thread. */
static void finish(struct waiter *waiter, const struct outcome *outcome)
{
    struct parts *p = parts_of(waiter);
    struct call *resumes = NULL;
    pthread_mutex_lock(&p->lock);
    if (p->call) {
        p->config.ended(p->call, outcome);
        p->failure = outcome->error;
        if (outcome->error.code == PEN_OK) {
            picture_release(p->next);
            p->next = picture_reference(outcome->picture);
            p->is_last = true;
        }
        if (!p->resumed)
            resumes = p->call;
        p->resumed = true;
        wake(p);
    }
    pthread_mutex_unlock(&p->lock);
    if (resumes)
        call_resume(resumes, &outcome->error);
    release(p);
}

struct parts *parts_create(const struct parts_config *config)
{
    struct parts *p = pen_alloc_zero(1, sizeof *p);
    pthread_mutex_init(&p->lock, NULL);
    p->references = 1;
    p->config = *config;
    p->call = config->call;
    p->service = config->call->service;
    return p;
}

bool parts_submit(struct parts *p, const struct pen_request *request,
    const uint8_t key[PEN_ID_BYTES], bool shareable, const struct waiter *like,
    struct pen_error *error)
{
    p->references++;
    p->waiter = *like;
    p->waiter.is_gone = is_gone;
    p->waiter.finish = finish;
    p->waiter.part = part;
    p->waiter.wants_part = true;
    if (scheduler_submit(p->service->scheduler, request, key, shareable, &p->waiter, error))
        return true;
    p->references--;
    return false;
}

void parts_give(struct parts *p, struct picture *last)
{
    p->next = picture_reference(last);
    p->is_last = true;
}

const struct picture *parts_first(const struct parts *p)
{
    return p->next;
}

void parts_leave(struct parts *p)
{
    if (!p)
        return;
    pthread_mutex_lock(&p->lock);
    p->call = NULL;
    pthread_mutex_unlock(&p->lock);
    release(p);
}

/* ---- what is sent ---- */

static void clear(struct parts *p)
{
    picture_release(p->shown);
    free(p->before);
    free(p->after);
    p->shown = NULL;
    p->before = p->after = NULL;
    memset(p->pieces, 0, sizeof p->pieces);
    p->piece = 0;
}

static char *format(const char *pattern, ...) __attribute__((format(printf, 1, 2)));
static char *format(const char *pattern, ...)
{
    char *text;
    va_list args;
    va_start(args, pattern);
    int size = vasprintf(&text, pattern, args);
    va_end(args);
    if (size < 0)
        abort();
    return text;
}

/* Takes the texts; the picture's bytes come between them. */
static void set_pieces(struct parts *p, char *before, char *after)
{
    p->before = before;
    p->after = after;
    if (before)
        p->pieces[0] = (struct piece){before, strlen(before)};
    if (p->shown)
        p->pieces[1] = (struct piece){p->shown->data, p->shown->size};
    if (after)
        p->pieces[2] = (struct piece){after, strlen(after)};
}

/* The request's id is random: no picture contains it. */
static const char *boundary(const struct parts *p)
{
    return p->config.call->exchange->request_id;
}

/* A browser shows a picture when it has the boundary behind it and the header of the next one. So the
 * next header goes with it, and cannot say what is not known yet: it has nothing but a type. */
static void put_picture(struct parts *p, bool is_last)
{
    const char *type = pen_format_mime[p->shown->result.completed.output.format];
    char *before = p->begun ? NULL : format("--%s\r\nContent-Type: %s\r\n\r\n", boundary(p), type);
    char *after = is_last ? format("\r\n--%s--\r\n", boundary(p))
                          : format("\r\n--%s\r\nContent-Type: %s\r\n\r\n", boundary(p), type);
    set_pieces(p, before, after);
}

static char *make_record(struct parts *p, bool is_last)
{
    struct service *s = p->service;
    const struct call *call = p->config.call;
    const struct auto_render *choice = p->config.choice;
    char href[HREF_BYTES];
    snprintf(href, sizeof href, "/v1/results/%s", p->shown->tag);
    const struct pen_progress *progress = &p->shown->result.progress;
    bool stateful = pen_request_is_stateful(&p->shown->result.completed, s->catalogue);
    bool complete = is_last && progress->done >= progress->total && !stateful;
    /* What got better goes to a shelf of its own and leaves finished pictures alone. */
    bool kept = complete ? picture_cost(p->shown) <= s->config->result_cache.bytes
                         : result_cache_put(s->part_cache, p->shown);
    struct pen_record_extra extra = {.request_id = call->exchange->request_id,
        .image_href = kept ? href : NULL,
        .etag = p->shown->tag,
        .total_ms = clock_ms(clock_now_ns() - call->exchange->body_ns),
        .from_cache = call->note.cached,
        .choice = *choice->why ? choice->why : NULL,
        .choice_met = choice->met};
    return pen_json_put_links(
        pen_result_json(&p->shown->result, &extra, s->catalogue), call->prefix);
}

static void put_event(struct parts *p, bool is_last)
{
    char *record = make_record(p, is_last);
    picture_release(p->shown); /* only its link is sent */
    p->shown = NULL;
    set_pieces(p, format("event: %s\ndata: %s\n\n", is_last ? "done" : "picture", record), NULL);
    free(record);
}

/* Once pictures have been sent, the status cannot tell of an error any more. */
static void put_failure(struct parts *p, const struct pen_error *failure)
{
    struct call *call = p->config.call;
    char *problem = call_problem(call, failure);
    if (p->config.form == ACCEPT_EVENTS)
        set_pieces(p, format("event: problem\ndata: %s\n\n", problem), NULL);
    else
        set_pieces(p,
            format("\r\n--%s\r\nContent-Type: application/problem+json\r\n\r\n%s\r\n", boundary(p),
                problem),
            NULL);
    p->broken = p->config.form != ACCEPT_EVENTS;
    free(problem);
}

/* Makes the pieces of what comes next; false when there is nothing yet. */
static bool take_next(struct parts *p)
{
    pthread_mutex_lock(&p->lock);
    struct picture *next = p->next;
    struct pen_error failure = p->failure;
    bool is_last = p->is_last, keep_alive = p->keep_alive;
    p->next = NULL;
    p->keep_alive = false;
    bool nothing = !next && failure.code == PEN_OK && !keep_alive;
    if (nothing) {
        p->asleep = true;
        p->slept_ns = clock_now_ns();
        http_sleep(p->call->exchange);
    }
    pthread_mutex_unlock(&p->lock);
    if (nothing) {
        scheduler_want_part(p->service->scheduler, &p->waiter);
        return false;
    }
    p->over = failure.code != PEN_OK || (next && is_last);
    p->shown = next;
    if (failure.code != PEN_OK) {
        clear(p);
        put_failure(p, &failure);
    } else if (!next) {
        set_pieces(p, format(": still at work\n\n"), NULL);
    } else if (p->config.form == ACCEPT_EVENTS) {
        put_event(p, is_last);
    } else {
        put_picture(p, is_last);
    }
    p->begun = true;
    return true;
}

static int64_t read_parts(void *owner, void *to, size_t most)
{
    struct parts *p = owner;
    for (;;) {
        while (p->piece < 3 && !p->pieces[p->piece].bytes)
            p->piece++;
        if (p->piece < 3) {
            struct piece *piece = &p->pieces[p->piece];
            size_t bytes = piece->bytes < most ? piece->bytes : most;
            memcpy(to, piece->data, bytes);
            piece->data = (const char *)piece->data + bytes;
            piece->bytes -= bytes;
            return (int64_t)bytes;
        }
        clear(p);
        if (p->over)
            return p->broken ? HTTP_STREAM_BROKEN : HTTP_STREAM_OVER;
        if (!take_next(p))
            return 0;
    }
}

void parts_answer(struct parts *p)
{
    struct http_exchange *x = p->config.call->exchange;
    char type[120];
    bool events = p->config.form == ACCEPT_EVENTS;
    snprintf(type, sizeof type, events ? "%s" : "%s; boundary=%s", accept_form_mime[p->config.form],
        boundary(p));
    struct http_stream stream = {.read = read_parts, .owner = p};
    http_add_header(x, "Vary", "Accept");
    http_add_header(x, "Cache-Control", "no-store, no-transform");
    http_add_header(x, "X-Accel-Buffering", "no"); /* proxies pass each part on at once */
    http_answer_stream(x, 200, type, stream);
}
