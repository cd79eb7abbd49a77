/* Jobs: starting sequences, listing, describing, cancelling, and what they give. */
#include "protocol/json_result.h"
#include "protocol/json_sequence.h"
#include "protocol/json_writer.h"
#include "protocol/memory.h"
#include "server/auto/choice.h"
#include "server/http/accept.h"
#include "server/http/range.h"
#include "server/jobs/store/job_json.h"
#include "server/routes/jobs.h"
#include "server/routes/page.h"
#include "server/routes/routes.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define MOST_CHECKED_BYTES (64u << 20) /* that are read once more before they are sent */

/* ---- starting ---- */

static enum step_end start(struct call *call, struct pen_error *error)
{
    size_t bytes;
    const char *text = body_json(&call->body, &bytes);
    struct pen_sequence *sequence =
        pen_sequence_from_json(text, bytes, call->service->catalogue, AUTO_NAME, true, error);
    struct pen_request request;
    bool ok = sequence != NULL;
    if (ok) {
        pen_sequence_frame(sequence, 0, &request);
        ok = routes_check_store(call, &request, error);
    }
    pen_sequence_destroy(sequence);
    return ok ? routes_answer_job(call, JOB_SEQUENCE, text, bytes, error) : STEP_FAILED;
}

static const struct step steps[] = {
    {"recall key", routes_recall_key},
    {"start", start},
};

bool route_job_post(struct call *call, struct pen_error *error)
{
    if (call->exchange->query && *call->exchange->query)
        return pen_fail(
            error, PEN_MALFORMED, "", "A sequence is all in its body: there can be no query.");
    return call_run(call, steps, error);
}

/* ---- what there is ---- */

struct job_store *routes_find_job(struct call *call, struct job *job, struct pen_error *error)
{
    struct job_store *store = jobs_store(call->service->jobs, error);
    if (!store || !job_store_get(store, call->address.id, job, error))
        return NULL;
    if (call_may_touch(call, job->client))
        return store;
    pen_fail(error, PEN_NOT_FOUND, "", "There is no such job, or it has expired.");
    return NULL;
}

bool route_jobs(struct call *call, struct pen_error *error)
{
    struct job_store *store = jobs_store(call->service->jobs, error);
    static const char *const keys[] = {"state", NULL};
    struct page page;
    struct job jobs[PAGE_MOST + 1];
    if (!store || !page_read(call, keys, &page, error))
        return false;
    int state =
        page_is_chosen(&page) ? pen_choice_index(job_state_names, page.values[0]) : JOB_STATES;
    if (state < 0)
        return pen_fail(error, PEN_INVALID, "/state", "There is no state \"%s\".", page.values[0]);
    struct job_page part = {.client = call->service->auth ? call_owner(call) : 0,
        .state = (enum job_state)state,
        .before = page.has_after ? page.after : NULL,
        .jobs = jobs,
        .most = page.limit + 1};
    if (!job_store_list(store, &part, error))
        return false;
    uint32_t shown = part.count > page.limit ? page.limit : part.count;
    struct pen_json json = {0};
    pen_json_object(&json, NULL);
    pen_json_array(&json, "jobs");
    for (uint32_t i = 0; i < shown; i++)
        job_write(&json, NULL, &jobs[i]);
    pen_json_end(&json);
    pen_json_uint(&json, "total", part.total);
    if (part.count > shown)
        page_write_next(&json, "/v1/jobs", keys, &page, jobs[shown - 1].id);
    pen_json_end(&json);
    http_add_header(call->exchange, "Cache-Control", "no-store");
    return call_json(call, 200, pen_json_finish(&json, NULL));
}

bool route_job(struct call *call, struct pen_error *error)
{
    struct job job;
    if (!routes_find_job(call, &job, error))
        return false;
    http_add_header(call->exchange, "Cache-Control", "no-store");
    return call_json(call, 200, job_json(&job));
}

bool route_job_delete(struct call *call, struct pen_error *error)
{
    struct job job;
    bool removed;
    if (!routes_find_job(call, &job, error) ||
        !jobs_delete(call->service->jobs, job.id, &removed, error))
        return false;
    if (!removed)
        return route_job(call, error);
    http_answer(call->exchange, 204, NULL, http_static(NULL, 0));
    return true;
}

/* ---- files ---- */

static const char *mime_of(const char *name)
{
    const char *ending = strrchr(name, '.');
    int format = ending ? pen_choice_index(pen_format_names, ending + 1) : -1;
    if (format >= 0)
        return pen_format_mime[format];
    return ending && !strcmp(ending, ".zip") ? "application/zip" : "application/json";
}

/* A job that is over changes no more, and goes at a time that is known. */
static void add_expiry(struct call *call, const struct job *job)
{
    char date[64];
    time_t expires = (time_t)job->expires_s;
    struct tm parts;
    if (!job_is_over(job->state)) {
        http_add_header(call->exchange, "Cache-Control", "no-cache");
        return;
    }
    long long left = job->expires_s - jobs_now_s();
    strftime(date, sizeof date, "%a, %d %b %Y %H:%M:%S GMT", gmtime_r(&expires, &parts));
    http_add_header(call->exchange, "Expires", "%s", date);
    http_add_header(call->exchange, "Cache-Control", "private, max-age=%lld", left > 0 ? left : 0);
}

/* A document that was kept, with its links as they lead from here; NULL: see *error. */
static char *read_document(
    struct call *call, const struct job *job, const struct job_file *file, struct pen_error *error)
{
    int fd = jobs_open_file(call->service->jobs, job->id, file, true, error);
    if (fd < 0)
        return NULL;
    char *text = pen_alloc(file->bytes + 1, 1);
    ssize_t n = pread(fd, text, file->bytes, 0);
    close(fd);
    if (n != (ssize_t)file->bytes) {
        free(text);
        pen_fail(error, PEN_UNAVAILABLE, "", "The document could not be read.");
        return NULL;
    }
    text[n] = 0;
    return pen_json_put_links(text, call->prefix);
}

static bool send_file(
    struct call *call, const struct job *job, const struct job_file *file, struct pen_error *error)
{
    struct http_exchange *x = call->exchange;
    const char *mime = mime_of(file->name);
    bool is_document = !strcmp(mime, "application/json");
    char *text = is_document ? read_document(call, job, file, error) : NULL;
    if (is_document && !text)
        return false;
    uint64_t bytes = text ? strlen(text) : file->bytes, from = 0, count = bytes;
    /* Ranges are GET's alone (RFC 9110, 14.2). */
    const char *asked = strcmp(x->method, "GET") ? NULL : http_header(x, "Range");
    enum range range =
        range_read(asked, http_header(x, "If-Range"), file->tag, bytes, &from, &count);
    add_expiry(call, job);
    http_add_header(x, "Accept-Ranges", "bytes");
    bool known = call_not_modified(call, file->tag);
    if (known || range == RANGE_OUTSIDE)
        free(text);
    if (known)
        return true;
    if (range == RANGE_OUTSIDE) {
        http_add_header(x, "Content-Range", "bytes */%llu", (unsigned long long)bytes);
        return pen_fail(error, PEN_RANGE, "", "There are %llu bytes.", (unsigned long long)bytes);
    }
    bool checked = range == RANGE_ALL && file->bytes <= MOST_CHECKED_BYTES;
    int fd = text ? 0 : jobs_open_file(call->service->jobs, job->id, file, checked, error);
    if (fd < 0)
        return false;
    if (range == RANGE_PART)
        http_add_header(x, "Content-Range", "bytes %llu-%llu/%llu", (unsigned long long)from,
            (unsigned long long)(from + count - 1), (unsigned long long)bytes);
    uint32_t status = range == RANGE_PART ? 206 : 200;
    if (text)
        http_answer(x, status, mime, (struct http_body){text + from, count, free, text});
    else
        http_answer_file(x, status, mime, (struct http_file){fd, from, count});
    return true;
}

static bool send_frame(struct call *call, struct job_store *store, const struct job *job,
    uint32_t number, struct pen_error *error)
{
    struct job_frame frame;
    if (number >= job->frames)
        return pen_fail(error, PEN_NOT_FOUND, "", "This job has %u frames.", job->frames);
    return job_store_frame(store, job->id, number, &frame, error) &&
           send_file(call, job, &frame.file, error);
}

/* The image, or with Accept the request that gives it by itself. */
bool route_job_frame(struct call *call, struct pen_error *error)
{
    struct job job;
    struct pen_request request;
    uint32_t number = call->address.number;
    struct job_store *store = routes_find_job(call, &job, error);
    if (!store)
        return false;
    http_add_header(call->exchange, "Vary", "Accept");
    if (accept_form(http_header(call->exchange, "Accept")) != ACCEPT_RECORD)
        return send_frame(call, store, &job, number, error);
    if (!jobs_frame_request(call->service->jobs, &job, number, &request, error))
        return false;
    http_add_header(call->exchange, "Cache-Control", "no-store");
    return call_json(call, 200, pen_request_json(&request, call->service->catalogue));
}

bool route_job_result(struct call *call, struct pen_error *error)
{
    struct job job;
    struct job_store *store = routes_find_job(call, &job, error);
    if (!store)
        return false;
    if (job.kind == JOB_RENDER)
        return send_frame(call, store, &job, 0, error);
    if (*job.result.name)
        return send_file(call, &job, &job.result, error);
    return pen_fail(error, PEN_NOT_FOUND, "",
        job_is_over(job.state) ? "This job has no result but its frames."
                               : "The job is not over: its result is not there yet.");
}
