/* What becomes of a job, as server-sent events. An event's id is the job's count of them: what came
 * after one is in the database, however often the connection or the daemon goes. */
#include "protocol/container.h"
#include "protocol/json_writer.h"
#include "protocol/memory.h"
#include "server/jobs/store/job_json.h"
#include "server/routes/jobs.h"
#include "server/routes/routes.h"
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PIECE_FRAMES 32
#define RETRY_MS 2000 /* until a client that lost the connection comes again */

struct events {
    struct job_watch watch;
    pthread_mutex_t lock; /* guards the four below, and is held while http.h is called */
    bool changed, beat, closing, asleep;
    struct http_exchange *exchange;
    struct jobs *jobs;
    char prefix[PROXY_PREFIX_BYTES];
    /* Of the thread that sends: */
    uint8_t id[PEN_ID_BYTES];
    uint32_t seq; /* of the last event that was put */
    char *text;
    size_t bytes, at;
    bool over;
};

/* Any thread. */
static void tell(struct job_watch *watch, enum job_news news)
{
    struct events *e = container_of(watch, struct events, watch);
    pthread_mutex_lock(&e->lock);
    e->changed |= news == JOB_CHANGED;
    e->beat |= news == JOB_BEAT;
    e->closing |= news == JOB_CLOSING;
    if (e->asleep) {
        e->asleep = false;
        http_wake(e->exchange);
    }
    pthread_mutex_unlock(&e->lock);
}

static void release(void *owner)
{
    struct events *e = owner;
    jobs_unwatch(e->jobs, &e->watch);
    pthread_mutex_destroy(&e->lock);
    free(e->text);
    free(e);
}

static void append(struct events *e, uint32_t seq, const char *kind, const char *data)
{
    char head[80];
    int head_bytes = snprintf(head, sizeof head, "id: %u\nevent: %s\ndata: ", seq, kind);
    size_t data_bytes = strlen(data);
    e->text = pen_realloc_array(e->text, e->bytes + (size_t)head_bytes + data_bytes + 3, 1);
    memcpy(e->text + e->bytes, head, (size_t)head_bytes);
    memcpy(e->text + e->bytes + head_bytes, data, data_bytes);
    memcpy(e->text + e->bytes + (size_t)head_bytes + data_bytes, "\n\n", 3);
    e->bytes += (size_t)head_bytes + data_bytes + 2;
    e->seq = seq;
}

static void append_frame(
    struct events *e, const struct job *job, const struct job_frame *frame, uint32_t done)
{
    char href[PEN_ID_HEX + 48], id[PEN_ID_HEX + 1];
    struct pen_json json = {0};
    pen_id_to_hex(job->id, id);
    snprintf(href, sizeof href, "/v1/jobs/%s/frames/%u", id, frame->number);
    pen_json_object(&json, NULL);
    pen_json_uint(&json, "frame", frame->number);
    pen_json_uint(&json, "bytes", frame->file.bytes);
    pen_json_link(&json, "href", href);
    pen_json_uint(&json, "done", done);
    pen_json_uint(&json, "total", job->frames);
    pen_json_end(&json);
    char *data = pen_json_put_links(pen_json_finish(&json, NULL), e->prefix);
    append(e, frame->seq, "frame", data);
    free(data);
}

static void append_state(struct events *e, const struct job *job)
{
    char *data = pen_json_put_links(job_json(job), e->prefix);
    append(e, job->state_seq, "state", data);
    free(data);
}

/* Puts what came after the last event, as far as it fits into one piece. */
static void put_news(struct events *e)
{
    struct job job;
    struct job_frame frames[PIECE_FRAMES];
    uint32_t count = 0, before = 0;
    struct pen_error error = {0};
    struct job_store *store = jobs_store(e->jobs, &error);
    if (!store || !job_store_get(store, e->id, &job, &error) ||
        !job_store_frames(store, e->id, e->seq, frames, PIECE_FRAMES, &count, &before, &error)) {
        e->over = true; /* removed, or unknown: the client asks again and is told */
        return;
    }
    bool state_is_new = job.state_seq > e->seq;
    for (uint32_t i = 0; i < count; i++) {
        if (state_is_new && job.state_seq < frames[i].seq) {
            append_state(e, &job);
            state_is_new = false;
        }
        append_frame(e, &job, &frames[i], before + i + 1);
    }
    if (count == PIECE_FRAMES)
        return;
    if (state_is_new)
        append_state(e, &job);
    e->over = job_is_over(job.state);
}

/* Sleeps until there is something to say; false when there is already. */
static bool sleep_if_idle(struct events *e)
{
    static const char beat[] = ": still there\n\n";
    pthread_mutex_lock(&e->lock);
    bool idle = !e->changed && !e->closing && !e->beat;
    bool only_beat = e->beat && !e->changed && !e->closing;
    e->beat = false;
    e->over |= e->closing;
    if (idle) {
        e->asleep = true;
        http_sleep(e->exchange);
    }
    pthread_mutex_unlock(&e->lock);
    if (only_beat) {
        e->text = strdup(beat);
        e->bytes = sizeof beat - 1;
    }
    return idle;
}

static int64_t read_events(void *owner, void *to, size_t most)
{
    struct events *e = owner;
    for (;;) {
        if (e->at < e->bytes) {
            size_t bytes = e->bytes - e->at < most ? e->bytes - e->at : most;
            memcpy(to, e->text + e->at, bytes);
            e->at += bytes;
            return (int64_t)bytes;
        }
        free(e->text);
        e->text = NULL;
        e->bytes = e->at = 0;
        if (e->over)
            return HTTP_STREAM_OVER;
        pthread_mutex_lock(&e->lock);
        e->changed = false;
        pthread_mutex_unlock(&e->lock);
        put_news(e);
        if (!e->bytes && !e->over && sleep_if_idle(e))
            return 0;
    }
}

/* What the client has already; 0: nothing. */
static uint32_t last_event(const struct call *call)
{
    const char *text = http_header(call->exchange, "Last-Event-ID");
    unsigned long long seq = text && *text >= '0' && *text <= '9' ? strtoull(text, NULL, 10) : 0;
    return seq < UINT32_MAX ? (uint32_t)seq : 0;
}

bool route_job_events(struct call *call, struct pen_error *error)
{
    struct job job;
    struct http_exchange *x = call->exchange;
    if (!routes_find_job(call, &job, error))
        return false;
    uint32_t seq = last_event(call);
    http_add_header(x, "Cache-Control", "no-store, no-transform");
    if (job_is_over(job.state) && seq >= job.seq) { /* a browser asks no more */
        http_answer(x, 204, NULL, http_static(NULL, 0));
        return true;
    }
    struct events *e = pen_alloc_zero(1, sizeof *e);
    pthread_mutex_init(&e->lock, NULL);
    memcpy(e->id, job.id, PEN_ID_BYTES);
    memcpy(e->watch.id, job.id, PEN_ID_BYTES);
    e->watch.tell = tell;
    e->exchange = x;
    strcpy(e->prefix, call->prefix);
    e->jobs = call->service->jobs;
    e->seq = seq < job.seq ? seq : job.seq;
    e->bytes = (size_t)asprintf(&e->text, "retry: %d\n\n", RETRY_MS);
    jobs_watch(e->jobs, &e->watch);
    http_add_header(x, "X-Accel-Buffering", "no"); /* proxies pass each event on at once */
    http_answer_stream(x, 200, "text/event-stream",
        (struct http_stream){.read = read_events, .release = release, .owner = e});
    return true;
}
