/* What each address does: one handler per row of endpoints.def, called when the whole request is
 * there. It answers, or has the call wait and be resumed; false, with the error filled, answers
 * with a problem document. A row without its handler does not link. */
#pragma once
#include "server/jobs/jobs.h"
#include "server/routes/call.h"

extern const struct http_callbacks routes_callbacks, routes_admin_callbacks;

#define ENDPOINT(id, ...) bool route_##id(struct call *call, struct pen_error *error);
#include "protocol/endpoints.def"
#undef ENDPOINT

/* What each event of /v1/events says; malloc'd. */
char *routes_live_json(void *service);
/* Addresses name their entry by its id or by the first digits of it: puts the whole id in place of
 * these, as far as the caller may see what there is. Errors: PEN_NOT_FOUND, PEN_AMBIGUOUS with what
 * it may be, PEN_INVALID where all digits are asked for, and those of the jobs' database. */
bool routes_resolve(struct call *call, struct pen_error *error);
/* Everything that a request refers to must be in the store. */
bool routes_check_store(
    struct call *call, const struct pen_request *request, struct pen_error *error);
/* What a client asked for as "Idempotency-Key": answers with the job that it got before, remembers a
 * request that is answered at once, and refuses another request under the same key. */
enum step_end routes_recall_key(struct call *call, struct pen_error *error);
/* Prefer: respond-async. */
bool routes_wants_job(const struct call *call);
/* Makes a job of `body` and answers 202. Errors: those of jobs_submit. */
enum step_end routes_answer_job(
    struct call *call, enum job_kind kind, const char *body, size_t bytes, struct pen_error *error);
