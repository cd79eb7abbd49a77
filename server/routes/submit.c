/* Requests that become jobs, and those that clients may send twice. */
#include "protocol/request.h"
#include "server/base/hash.h"
#include "server/jobs/store/job_json.h"
#include "server/routes/routes.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#define KEY_BYTES 255

bool routes_wants_job(const struct call *call)
{
    static const char word[] = "respond-async";
    const char *at = http_header(call->exchange, "Prefer");
    while (at && *at) {
        at += strspn(at, " \t,");
        size_t bytes = strcspn(at, " \t,;");
        if (bytes == sizeof word - 1 && !strncasecmp(at, word, bytes))
            return true;
        at += strcspn(at, ",");
    }
    return false;
}

/* ---- keys ---- */

/* What tells one request from another: the address, the body, and whether a job is wanted. */
static void take_print(const struct call *call, uint8_t print[PEN_ID_BYTES])
{
    struct hash *hash = hash_create();
    struct http_exchange *x = call->exchange;
    const char *form = routes_wants_job(call) ? "\njob\n" : "\n\n";
    hash_add(hash, x->method, strlen(x->method));
    hash_add(hash, x->path, strlen(x->path));
    hash_add(hash, form, strlen(form));
    if (call->body.text_bytes)
        hash_add(hash, call->body.text, call->body.text_bytes);
    hash_finish(hash, print);
}

/* *given: the request has a key. */
static bool read_key(
    const struct call *call, struct job_key *key, bool *given, struct pen_error *error)
{
    const char *text = http_header(call->exchange, "Idempotency-Key");
    *given = text && call->address.route->flags & PEN_ROUTE_KEYED;
    if (!*given)
        return true;
    for (const char *c = text; *c; c++)
        if (*c < 0x20 || *c > 0x7e)
            return pen_fail(error, PEN_MALFORMED, "", "Idempotency-Key holds an odd character.");
    if (!*text || strlen(text) > KEY_BYTES)
        return pen_fail(
            error, PEN_MALFORMED, "", "Idempotency-Key has 1 to %d characters.", KEY_BYTES);
    *key = (struct job_key){.client = call_owner(call),
        .text = text,
        .expires_s = jobs_now_s() + (int64_t)call->service->config->jobs_keep_s};
    take_print(call, key->print);
    return true;
}

static void answer(struct call *call, const struct job *job)
{
    char id[PEN_ID_HEX + 1];
    pen_id_to_hex(job->id, id);
    http_add_header(call->exchange, "Location", "%s/v1/jobs/%s", call->prefix, id);
    http_add_header(call->exchange, "Cache-Control", "no-store");
    if (call->address.route->flags & PEN_ROUTE_ASYNC)
        http_add_header(call->exchange, "Preference-Applied", "respond-async");
    call_json(call, 202, job_json(job));
}

enum step_end routes_recall_key(struct call *call, struct pen_error *error)
{
    struct job_key key;
    struct job job;
    struct pen_error none = {0};
    bool given, found, has_job;
    if (!read_key(call, &key, &given, error))
        return STEP_FAILED;
    struct job_store *store = given ? jobs_store(call->service->jobs, &none) : NULL;
    if (!store) /* what becomes a job says why; what is answered at once is the same each time */
        return STEP_NEXT;
    if (!job_store_find_key(store, &key, jobs_now_s(), &found, &has_job, job.id, &none) &&
        none.code == PEN_INVALID) {
        *error = none;
        return STEP_FAILED;
    }
    if (has_job && job_store_get(store, job.id, &job, NULL)) {
        answer(call, &job);
        return STEP_OVER;
    }
    bool becomes_job = routes_wants_job(call) || call->address.route->flags & PEN_ROUTE_JOB;
    if (!found && !becomes_job)
        job_store_keep_key(store, &key, NULL);
    return STEP_NEXT;
}

/* ---- jobs ---- */

enum step_end routes_answer_job(
    struct call *call, enum job_kind kind, const char *body, size_t bytes, struct pen_error *error)
{
    struct jobs *jobs = call->service->jobs;
    struct job_key key;
    struct job job;
    bool given;
    struct job_order order = {
        .kind = kind, .client = call_owner(call), .body = body, .bytes = bytes};
    memcpy(order.scene, call->address.id, PEN_ID_BYTES);
    if (!read_key(call, &key, &given, error))
        return STEP_FAILED;
    order.key = given ? &key : NULL;
    struct job_store *store = jobs_store(jobs, error);
    if (!store || !jobs_submit(jobs, &order, job.id, error) ||
        !job_store_get(store, job.id, &job, error))
        return STEP_FAILED;
    answer(call, &job);
    return STEP_OVER;
}
