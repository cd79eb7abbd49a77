/* The admin listener: /livez, /readyz and /metrics. Busy is not ready, but never not live. */
#include "protocol/json_writer.h"
#include "protocol/memory.h"
#include "server/base/clock.h"
#include "server/base/log.h"
#include "server/base/status.h"
#include "server/routes/routes.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define RECENT_MS 10000 /* that live figures look back on */
#define CANARY_DEADLINE_MS 5000
#define CANARY_SIDE 32

struct probe {
    struct waiter waiter;
    struct http_exchange *exchange;
    struct service *service;
};

static void answer_text(struct http_exchange *x, uint32_t status, const char *text)
{
    http_add_header(x, "Cache-Control", "no-store");
    if (status == 503)
        http_add_header(x, "Retry-After", "1");
    http_answer(x, status, "text/plain; charset=utf-8", http_static(text, strlen(text)));
}

/* ---- readiness ---- */

/* Why it is not ready (a constant sentence), or NULL: it is, as far as can be told without a test
 * render. */
static const char *obstacle_of(struct service *s)
{
    struct worker_pool_numbers pool;
    struct scheduler_numbers queue;
    worker_pool_read(s->pool, &pool);
    scheduler_read(s->scheduler, &queue);
    if (service_is_draining(s))
        return "The service is shutting down.";
    if (!pool.warmed)
        return "The worker is still warming up.";
    if (!pool.up)
        return "No worker is up.";
    if (pool.silent >= pool.up)
        return "No worker answers.";
    if (queue.full)
        return "The queue is full.";
    return NULL;
}

static void finish_canary(struct waiter *waiter, const struct outcome *outcome)
{
    struct probe *probe = (struct probe *)waiter;
    struct service *s = probe->service;
    struct http_exchange *x = probe->exchange;
    bool ok = outcome->error.code == PEN_OK;
    pthread_mutex_lock(&s->canary_lock);
    s->canary_ns = clock_now_ns();
    s->canary_failed = !ok;
    pthread_mutex_unlock(&s->canary_lock);
    if (!ok)
        log_event(LOG_ERROR, "the canary was not rendered: %s", outcome->error.message);
    answer_text(x, ok ? 200 : 503, ok ? "ready\n" : "A test render failed.\n");
}

static void readyz(struct http_exchange *x, struct service *s)
{
    const char *obstacle = obstacle_of(s);
    if (obstacle) {
        answer_text(x, 503, obstacle);
        return;
    }
    pthread_mutex_lock(&s->canary_lock);
    uint64_t now = clock_now_ns();
    bool recent = s->canary_ns && now - s->canary_ns < s->config->canary_interval_ms * CLOCK_MS;
    bool failed = s->canary_failed;
    pthread_mutex_unlock(&s->canary_lock);
    if (recent && !failed) {
        answer_text(x, 200, "ready\n");
        return;
    }
    struct pen_request request;
    struct pen_error error = {0};
    uint8_t key[PEN_ID_BYTES];
    struct probe *probe = pen_alloc_zero(1, sizeof *probe);
    x->user = probe;
    probe->exchange = x;
    probe->service = s;
    probe->waiter.deadline_ns = now + CANARY_DEADLINE_MS * CLOCK_MS;
    probe->waiter.finish = finish_canary;
    pen_request_default(&request, s->catalogue);
    memcpy(request.scene, s->canary_id, PEN_ID_BYTES);
    request.width = request.height = CANARY_SIDE;
    picture_key(&request, key);
    http_defer(x);
    if (!scheduler_submit(s->scheduler, &request, key, true, &probe->waiter, &error))
        answer_text(x, 503, "The queue is full.\n");
}

/* ---- numbers ---- */

/* One of the service's numbers. */
struct figure {
    const char *name, *type, *help;
    double value;
};
#define MOST_FIGURES 80

static uint32_t read_figures(struct service *s, struct figure figures[MOST_FIGURES])
{
    struct worker_pool_numbers pool;
    struct scheduler_numbers queue;
    struct importer_numbers imports;
    struct result_cache_numbers cache;
    struct door_numbers door;
    struct job_numbers jobs;
    bool has_jobs = jobs_read(s->jobs, &jobs);
    worker_pool_read(s->pool, &pool);
    scheduler_read(s->scheduler, &queue);
    importer_read(s->importer, &imports);
    result_cache_read(s->cache, &cache);
    door_read(http_listener_door(s->listener), &door);
    const struct figure rows[] = {
        {"penumbra_uptime_seconds", "gauge", "Since the start.",
            clock_ms(clock_now_ns() - s->started_ns) / 1e3},
        {"penumbra_ready", "gauge", "1: takes renders.", obstacle_of(s) == NULL},
        {"penumbra_draining", "gauge", "1: shutting down.", service_is_draining(s)},
        {"penumbra_workers_up", "gauge", "Workers that take jobs.", pool.up},
        {"penumbra_worker_restarts_total", "counter", "Workers that ended.", pool.restarts},
        {"penumbra_worker_crashes_total", "counter", "Of these, by their own fault.", pool.crashes},
        {"penumbra_worker_out_of_memory_total", "counter", "Of these, because memory ran out.",
            pool.starved},
        {"penumbra_worker_hangs_total", "counter", "Of these, by the watchdog.", pool.hangs},
        {"penumbra_renders_cancelled_total", "counter",
            "Renders that were given up because nobody waited for them any more.", pool.cancelled},
        {"penumbra_render_retries_total", "counter", "Renders given to another worker.",
            pool.retries},
        {"penumbra_worker_back_seconds", "gauge", "From a worker's end to its successor's hello.",
            pool.back_ms / 1e3},
        {"penumbra_worker_warm_up_seconds", "gauge", "The last warm-up.", pool.warm_ms / 1e3},
        {"penumbra_shader_cache_fill_seconds", "gauge",
            "What compiling all methods into the driver's cache took; 0: not done.",
            pool.cache_ms / 1e3},
        {"penumbra_worker_context_seconds", "gauge", "The last context's creation.",
            pool.create_ms / 1e3},
        {"penumbra_quarantined_scenes", "gauge", "Scenes that ended two workers.",
            pool.quarantined},
        {"penumbra_gpu_bytes", "gauge",
            "Scenes, images, shadow inputs and pictures being made in GPU memory.",
            (double)pool.gpu_bytes},
        {"penumbra_programs", "gauge", "Compiled shader programs kept.", pool.programs.kept},
        {"penumbra_program_bytes", "gauge", "What they take, estimated from their texts.",
            (double)pool.programs.bytes},
        {"penumbra_program_compiles_total", "counter", "Programs compiled since the workers began.",
            pool.programs.compiled},
        {"penumbra_program_evictions_total", "counter", "Programs that left for others.",
            pool.programs.evicted},
        {"penumbra_queue_depth", "gauge", "Renders that wait.", queue.queued},
        {"penumbra_queue_limit", "gauge", "Renders that may wait.", (double)s->config->queue_limit},
        {"penumbra_renders_running", "gauge", "Renders on a worker.", queue.running},
        {"penumbra_renders_shared_total", "counter", "Requests that joined another's render.",
            (double)queue.shared},
        {"penumbra_renders_refused_full_total", "counter", "503: the queue was full.",
            (double)queue.refused_full},
        {"penumbra_renders_refused_share_total", "counter", "429: the client's share was used up.",
            (double)queue.refused_share},
        {"penumbra_renders_refused_late_total", "counter",
            "503: what came first would have taken longer than the deadline left.",
            (double)queue.refused_late},
        {"penumbra_backlog_seconds", "gauge",
            "What is queued and running will take, as far as that is known.",
            queue.backlog_ms / 1e3},
        {"penumbra_estimates", "gauge", "Kinds of renders whose cost is known.", queue.estimates},
        {"penumbra_renders_expired_total", "counter", "504: the deadline passed.",
            (double)queue.expired},
        {"penumbra_renders_abandoned_total", "counter",
            "Clients that hung up before their picture was there.", (double)queue.abandoned},
        {"penumbra_cache_bytes", "gauge", "Encoded images kept.", (double)cache.bytes},
        {"penumbra_cache_hits_total", "counter", "Images from the cache.", (double)cache.hits},
        {"penumbra_cache_misses_total", "counter", "Images not in the cache.",
            (double)cache.misses},
        {"penumbra_cache_evictions_total", "counter", "Images dropped for room.",
            (double)cache.evictions},
        {"penumbra_imports_waiting", "gauge", "Uploads that wait for their import.",
            imports.waiting},
        {"penumbra_imports_running", "gauge", "Importer processes.", imports.running},
        {"penumbra_imports_done_total", "counter", "Imports.", (double)imports.done},
        {"penumbra_imports_failed_total", "counter", "Uploads refused.", (double)imports.failed},
        {"penumbra_imports_crashed_total", "counter", "Importers that ended without a report.",
            (double)imports.crashed},
        {"penumbra_scenes", "gauge", "Scenes in the store.",
            scene_store_count(s->store, STORE_SCENES)},
        {"penumbra_images", "gauge", "Images in the store.",
            scene_store_count(s->store, STORE_IMAGES)},
        {"penumbra_store_bytes", "gauge", "What the store holds, with uploads under way.",
            (double)store_quota_used(scene_store_quota(s->store))},
        {"penumbra_store_limit_bytes", "gauge", "What it may hold; 0: as much as the disk does.",
            (double)s->config->store_limit.bytes},
        {"penumbra_store_faults_total", "counter", "Stored files that were found damaged.",
            (double)scene_store_faults(s->store)},
        {"penumbra_store_rounds_total", "counter", "Times that all that is stored was checked.",
            (double)scrubber_rounds(s->scrubber)},
        {"penumbra_jobs_under_way", "gauge", "Jobs that are not over.",
            jobs.jobs[JOB_ACCEPTED] + jobs.jobs[JOB_RUNNING]},
        {"penumbra_jobs_over", "gauge", "Jobs that are over and kept.",
            jobs.jobs[JOB_SUCCESSFUL] + jobs.jobs[JOB_FAILED] + jobs.jobs[JOB_DISMISSED]},
        {"penumbra_job_bytes", "gauge", "Results of jobs.", (double)jobs.bytes},
        {"penumbra_jobs_available", "gauge", "0: their database cannot be used.", has_jobs},
        {"penumbra_connections", "gauge", "Open public connections.", door.open},
        {"penumbra_connections_accepted_total", "counter", "Public connections.",
            (double)door.accepted},
        {"penumbra_connections_refused_total", "counter", "Connections above the limits.",
            (double)door.refused},
        {"penumbra_connections_too_slow_total", "counter", "Connections ended as too slow.",
            (double)door.too_slow},
        {"penumbra_connections_displaced_total", "counter",
            "Of these and of idle ones, those that others needed the place of.",
            (double)door.displaced},
        {"penumbra_requests_malformed_total", "counter", "Requests that were no HTTP.",
            (double)door.malformed},
        {"penumbra_received_bytes_total", "counter", "Request bodies.",
            (double)__atomic_load_n(&s->bytes_received, __ATOMIC_RELAXED)},
        {"penumbra_sent_bytes_total", "counter", "Answer bodies.",
            (double)__atomic_load_n(&s->bytes_sent, __ATOMIC_RELAXED)},
    };
    _Static_assert(sizeof rows / sizeof *rows <= MOST_FIGURES, "raise MOST_FIGURES");
    memcpy(figures, rows, sizeof rows);
    return sizeof rows / sizeof *rows;
}

static void write_device(struct service *s, struct metrics_text *text)
{
    struct worker_pool_numbers pool;
    worker_pool_read(s->pool, &pool);
    if (pool.has_device) {
        char renderer[sizeof pool.device.renderer];
        char *to = renderer;
        for (const char *c = pool.device.renderer; *c; c++)
            *to++ = *c == '"' || *c == '\\' || *c == '\n' ? '_' : *c;
        *to = 0;
        metrics_print(text,
            "# HELP penumbra_device_info What renders.\n"
            "# TYPE penumbra_device_info gauge\n"
            "penumbra_device_info{renderer=\"%s\",platform=\"%s\",software=\"%u\","
            "version=\"" PENUMBRA_VERSION "\"} 1\n",
            renderer, pool.device.platform, pool.device.software != 0);
    }
}

static void write_service(struct service *s, struct metrics_text *text)
{
    struct figure figures[MOST_FIGURES];
    uint32_t count = read_figures(s, figures);
    write_device(s, text);
    for (uint32_t i = 0; i < count; i++)
        metrics_print_one(
            text, figures[i].name, figures[i].type, figures[i].help, figures[i].value);
}

/* The same numbers for pages that show how the service is. */
char *routes_live_json(void *service)
{
    struct service *s = service;
    struct figure figures[MOST_FIGURES];
    struct pen_json json = {0};
    struct timespec now;
    uint32_t count = read_figures(s, figures);
    clock_gettime(CLOCK_REALTIME, &now);
    pen_json_object(&json, NULL);
    pen_json_double(&json, "unix_s", (double)now.tv_sec + 1e-3 * (double)(now.tv_nsec / 1000000));
    metrics_write_recent(s->metrics, RECENT_MS, &json);
    pen_json_object(&json, "metrics");
    for (uint32_t i = 0; i < count; i++)
        pen_json_double(&json, figures[i].name, figures[i].value);
    pen_json_end(&json);
    pen_json_end(&json);
    return pen_json_finish(&json, NULL);
}

static void metrics_page(struct http_exchange *x, struct service *s)
{
    struct metrics_text text = {0};
    write_service(s, &text);
    metrics_write(s->metrics, &text);
    http_answer(x, 200, "text/plain; version=0.0.4; charset=utf-8", http_text(text.text));
}

/* ---- callbacks ---- */

static void begin(struct http_exchange *x, const struct pen_error *fault)
{
    bool get = !strcmp(x->method, "GET") || !strcmp(x->method, "HEAD");
    if (fault->code != PEN_OK) {
        http_answer(x, http_status_of(fault->code).status, "application/problem+json",
            http_text(http_problem(fault, x->request_id)));
    } else if (!get) {
        http_add_header(x, "Allow", "GET, HEAD");
        answer_text(x, 405, "This listener takes GET and HEAD.\n");
    }
}

static void body(struct http_exchange *x, const void *data, size_t bytes)
{
    (void)data, (void)bytes;
    answer_text(x, 413, "This listener takes no bodies.\n");
}

static void livez(struct http_exchange *x, struct service *s)
{
    (void)s;
    answer_text(x, 200, "live\n");
}

static const struct {
    const char *path;
    void (*handle)(struct http_exchange *x, struct service *s);
} pages[] = {{"/livez", livez}, {"/readyz", readyz}, {"/metrics", metrics_page}};

/* Whether it is alive and ready anybody may ask. */
static bool may_see(struct http_exchange *x, struct service *s, const char *path)
{
    struct auth_grant grant;
    return s->admin_is_open || !s->auth || strcmp(path, "/metrics") ||
           (auth_check(s->auth, http_header(x, "Authorization"), &grant) &&
               grant.scopes & AUTH_ADMIN);
}

static void end(struct http_exchange *x)
{
    for (size_t i = 0; i < sizeof pages / sizeof *pages; i++)
        if (!strcmp(x->path, pages[i].path)) {
            if (!may_see(x, http_listener_context(x->listener), x->path)) {
                http_add_header(x, "WWW-Authenticate", "Bearer");
                answer_text(x, 401, "Metrics need a token with \"admin\".\n");
                return;
            }
            pages[i].handle(x, http_listener_context(x->listener));
            return;
        }
    answer_text(x, 404, "There are /livez, /readyz and /metrics.\n");
}

static void completed(struct http_exchange *x)
{
    free(x->user);
}

const struct http_callbacks routes_admin_callbacks = {begin, body, end, completed};
