#include "server/routes/call.h"
#include "protocol/memory.h"
#include "server/base/status.h"
#include "server/http/tags.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool call_run(struct call *call, const struct step *first, struct pen_error *error)
{
    for (const struct step *step = first;; step++) {
        call->next = step + 1;
        switch (step->run(call, error)) {
        case STEP_NEXT:
            continue;
        case STEP_OVER:
            return true;
        case STEP_FAILED:
            return false;
        }
    }
}

uint64_t call_owner(const struct call *call)
{
    return call->client;
}

bool call_may_touch(const struct call *call, uint64_t owner)
{
    return !call->service->auth || owner == call->grant.owner || call->grant.scopes & AUTH_ADMIN;
}

char *call_problem(struct call *call, const struct pen_error *error)
{
    call->note.code = (enum pen_code)error->code;
    snprintf(call->note.error, sizeof call->note.error, "%.*s", (int)sizeof call->note.error - 1,
        error->message);
    return http_problem(error, call->exchange->request_id);
}

static void answer_problem(struct call *call, const struct pen_error *error)
{
    struct http_exchange *x = call->exchange;
    struct http_status told = http_status_of((enum pen_code)error->code);
    if (error->code == PEN_UNAVAILABLE || error->code == PEN_TOO_MANY ||
        error->code == PEN_HELD_BACK)
        http_add_header(x, "Retry-After", "%u", error->retry_after_s ? error->retry_after_s : 1);
    if (call->body.unknown_coding)
        http_add_header(x, "Accept-Encoding", "gzip");
    if (error->code == PEN_UNAUTHORIZED)
        http_add_header(x, "WWW-Authenticate", "Bearer");
    http_add_header(x, "Cache-Control", "no-store");
    http_answer(x, told.status, "application/problem+json", http_text(call_problem(call, error)));
}

void call_resume(struct call *call, const struct pen_error *failure)
{
    struct pen_error error = {0};
    if (failure && failure->code != PEN_OK)
        answer_problem(call, failure);
    else if (!call_run(call, call->next, &error))
        answer_problem(call, &error);
}

void *call_work(struct call *call, size_t bytes, void (*end)(struct call *call, void *work))
{
    call->work = pen_alloc_zero(1, bytes);
    call->end_work = end;
    return call->work;
}

bool call_json(struct call *call, uint32_t status, char *text)
{
    text = pen_json_put_links(text, call->prefix);
    http_answer(call->exchange, status, "application/json", http_text(text));
    return true;
}

bool call_knows(const struct call *call, const char *tag)
{
    const char *known = http_header(call->exchange, "If-None-Match");
    return known && tags_name(known, tag);
}

bool call_not_modified(struct call *call, const char *tag)
{
    const char *known = http_header(call->exchange, "If-None-Match");
    http_add_header(call->exchange, "ETag", "\"%s\"", tag);
    if (!call_knows(call, tag) && !(known && tags_are_any(known)))
        return false;
    http_answer(call->exchange, 304, NULL, http_static(NULL, 0));
    return true;
}
