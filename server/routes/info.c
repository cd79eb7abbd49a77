/* What the service tells about itself: pages, contract, methods, numbers. */
#include "protocol/json_result.h"
#include "protocol/json_sequence.h"
#include "server/base/clock.h"
#include "server/http/accept.h"
#include "server/pages/pages.h"
#include "server/routes/routes.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Asked for again each time, and sent when it is another. */
static bool answer_page(struct call *call, const struct page_file *file)
{
    struct http_exchange *x = call->exchange;
    bool squeezed = accept_coding(http_header(x, "Accept-Encoding"), "gzip");
    const struct page_bytes *sent = squeezed ? &file->gzip : &file->plain;
    if (file->type == PAGE_HTML)
        http_add_header(x, "Content-Security-Policy",
            "default-src 'self'; style-src 'self' 'unsafe-inline'; script-src 'self'; "
            "img-src 'self' blob: data:; "
            "form-action 'none'; frame-ancestors 'none'; base-uri 'none'");
    http_add_header(x, "Cache-Control", "no-cache");
    http_add_header(x, "Vary", "Accept-Encoding");
    if (call_not_modified(call, sent->tag))
        return true;
    if (squeezed)
        http_add_header(x, "Content-Encoding", "gzip");
    http_answer(x, 200, page_mime[file->type], http_static(sent->data, sent->bytes));
    return true;
}

static bool answer_file(struct call *call, const char *path, struct pen_error *error)
{
    const struct page_file *file = pages_find(path);
    return file ? answer_page(call, file)
                : pen_fail(error, PEN_NOT_FOUND, "", "There is nothing at this address.");
}

bool route_home(struct call *call, struct pen_error *error)
{
    return answer_file(call, "", error);
}

bool route_docs(struct call *call, struct pen_error *error)
{
    return answer_file(call, "docs", error);
}

bool route_client_module(struct call *call, struct pen_error *error)
{
    return answer_file(call, "penumbra.js", error);
}

bool route_view_module(struct call *call, struct pen_error *error)
{
    return answer_file(call, "penumbra-view.js", error);
}

static bool answer_named(struct call *call, const char *folder, struct pen_error *error)
{
    char path[64];
    snprintf(path, sizeof path, "%s%s", folder, call->address.name);
    return answer_file(call, path, error);
}

bool route_viewer(struct call *call, struct pen_error *error)
{
    return answer_named(call, "viewer/", error);
}

bool route_viewer_panel(struct call *call, struct pen_error *error)
{
    return answer_named(call, "viewer/panels/", error);
}

bool route_openapi(struct call *call, struct pen_error *error)
{
    (void)error;
    return answer_page(call, &call->service->openapi);
}

bool route_techniques(struct call *call, struct pen_error *error)
{
    (void)error;
    return answer_page(call, &call->service->techniques);
}

bool route_technique(struct call *call, struct pen_error *error)
{
    const char *name = call->address.name;
    const struct pen_technique_info *info = pen_catalogue_find(call->service->catalogue, name);
    if (!info)
        return pen_fail(error, PEN_NOT_FOUND, "", "There is no method called \"%s\".", name);
    return call_json(call, 200, pen_technique_json(info));
}

bool route_stats(struct call *call, struct pen_error *error)
{
    (void)error;
    http_add_header(call->exchange, "Cache-Control", "no-store");
    return call_json(call, 200, metrics_stats_json(call->service->metrics));
}

bool route_live(struct call *call, struct pen_error *error)
{
    (void)error;
    feed_answer(call->service->feed, call->exchange);
    return true;
}

static void write_limits(struct pen_json *json, const struct config *config)
{
    pen_json_object(json, "limits");
    pen_json_uint(json, "image_side_px", PEN_MAX_IMAGE_SIDE);
    pen_json_uint(json, "image_pixels", PEN_MAX_IMAGE_PIXELS);
    pen_json_uint(json, "antialias", PEN_MAX_ANTIALIAS);
    pen_json_uint(json, "lights", PEN_MAX_LIGHTS);
    pen_json_uint(json, "json_bytes", PEN_MAX_JSON_BYTES);
    pen_json_uint(json, "upload_bytes", config->upload_limit.bytes);
    pen_json_uint(json, "store_bytes", config->store_limit.bytes);
    pen_json_uint(json, "queued_renders", config->queue_limit);
    pen_json_uint(json, "renders_per_client", config->client_share);
    pen_json_uint(json, "jobs", config->jobs);
    pen_json_uint(json, "jobs_per_client", config->jobs_share);
    pen_json_uint(json, "job_bytes", config->jobs_limit.bytes);
    pen_json_uint(json, "sequence_frames", PEN_SEQUENCE_FRAMES);
    pen_json_uint(json, "gpu_memory_bytes", config->gpu_memory.bytes);
    pen_json_end(json);
}

bool route_service(struct call *call, struct pen_error *error)
{
    (void)error;
    struct service *s = call->service;
    struct worker_pool_numbers pool;
    struct scheduler_numbers queue;
    struct pen_json json = {0};
    worker_pool_read(s->pool, &pool);
    scheduler_read(s->scheduler, &queue);
    pen_json_object(&json, NULL);
    pen_json_string(&json, "name", "penumbra");
    pen_json_string(&json, "version", PENUMBRA_VERSION);
    pen_json_string(&json, "build", picture_build());
    pen_json_double(&json, "uptime_s", clock_ms(clock_now_ns() - s->started_ns) / 1e3);
    if (pool.has_device)
        pen_result_write_device(&json, "device", &pool.device);
    else
        pen_json_null(&json, "device");
    pen_json_object(&json, "workers");
    pen_json_uint(&json, "configured", s->config->workers);
    pen_json_uint(&json, "up", pool.up);
    pen_json_uint(&json, "restarts", pool.restarts);
    pen_json_double(&json, "context_ms", pool.create_ms);
    pen_json_double(&json, "warm_up_ms", pool.warm_ms);
    if (pool.restarts)
        pen_json_double(&json, "last_back_after_ms", pool.back_ms);
    pen_json_end(&json);
    pen_json_object(&json, "queue");
    pen_json_uint(&json, "waiting", queue.queued);
    pen_json_uint(&json, "rendering", queue.running);
    pen_json_end(&json);
    pen_json_uint(&json, "scenes", scene_store_count(s->store, STORE_SCENES));
    pen_json_uint(&json, "images", scene_store_count(s->store, STORE_IMAGES));
    pen_json_uint(&json, "gpu_bytes", pool.gpu_bytes);
    write_limits(&json, s->config);
    pen_json_object(&json, "links");
    pen_json_link(&json, "openapi", "/openapi.json");
    pen_json_link(&json, "docs", "/docs");
    pen_json_link(&json, "techniques", "/v1/techniques");
    pen_json_link(&json, "scenes", "/v1/scenes");
    pen_json_link(&json, "images", "/v1/images");
    pen_json_link(&json, "jobs", "/v1/jobs");
    pen_json_link(&json, "stats", "/v1/stats");
    pen_json_link(&json, "events", "/v1/events");
    pen_json_end(&json);
    pen_json_end(&json);
    http_add_header(call->exchange, "Cache-Control", "no-store");
    return call_json(call, 200, pen_json_finish(&json, NULL));
}
