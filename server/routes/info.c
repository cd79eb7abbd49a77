/* What the service tells about itself: pages, contract, methods, numbers. */
#include "protocol/json_result.h"
#include "protocol/json_sequence.h"
#include "server/base/clock.h"
#include "server/base/hash.h"
#include "server/pages/pages.h"
#include "server/routes/routes.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool answer_page(struct call *call, const char *text, size_t bytes, const char *scripts)
{
    http_add_header(call->exchange, "Content-Security-Policy",
        "default-src 'self'; style-src 'self' 'unsafe-inline'; script-src %s; img-src 'self' "
        "blob:; "
        "form-action 'none'; frame-ancestors 'none'; base-uri 'none'",
        scripts);
    http_add_header(call->exchange, "Cache-Control", "no-cache");
    http_answer(call->exchange, 200, "text/html; charset=utf-8", http_static(text, bytes));
    return true;
}

bool route_home(struct call *call, struct pen_error *error)
{
    (void)error;
    return answer_page(call, page_home, (size_t)(page_home_end - page_home), "'self'");
}

bool route_docs(struct call *call, struct pen_error *error)
{
    (void)error;
    return answer_page(
        call, page_docs, (size_t)(page_docs_end - page_docs), "'self' 'unsafe-inline'");
}

/* For pages of any origin that may call; asked for again each time, and sent when it is another. */
static bool answer_module(struct call *call, const char *text, size_t bytes)
{
    char tag[PEN_ID_HEX + 1];
    uint8_t digest[PEN_ID_BYTES];
    struct hash *hash = hash_create();
    hash_add(hash, text, bytes);
    hash_finish(hash, digest);
    pen_id_to_hex(digest, tag);
    http_add_header(call->exchange, "Cache-Control", "no-cache");
    if (!call_not_modified(call, tag))
        http_answer(
            call->exchange, 200, "text/javascript; charset=utf-8", http_static(text, bytes));
    return true;
}

bool route_home_module(struct call *call, struct pen_error *error)
{
    (void)error;
    return answer_module(call, module_home, (size_t)(module_home_end - module_home));
}

bool route_client_module(struct call *call, struct pen_error *error)
{
    (void)error;
    return answer_module(call, module_client, (size_t)(module_client_end - module_client));
}

bool route_view_module(struct call *call, struct pen_error *error)
{
    (void)error;
    return answer_module(call, module_view, (size_t)(module_view_end - module_view));
}

bool route_openapi(struct call *call, struct pen_error *error)
{
    (void)error;
    const struct service *s = call->service;
    http_add_header(call->exchange, "Cache-Control", "no-cache");
    if (!call_not_modified(call, s->openapi_tag))
        http_answer(
            call->exchange, 200, "application/json", http_static(s->openapi, strlen(s->openapi)));
    return true;
}

bool route_techniques(struct call *call, struct pen_error *error)
{
    (void)error;
    return call_json(call, 200, pen_techniques_json(call->service->catalogue));
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

static void write_link(
    struct pen_json *json, const struct call *call, const char *key, const char *path)
{
    char link[PROXY_PREFIX_BYTES + 32];
    snprintf(link, sizeof link, "%s%s", call->prefix, path);
    pen_json_string(json, key, link);
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
    write_link(&json, call, "openapi", "/openapi.json");
    write_link(&json, call, "docs", "/docs");
    pen_json_string(&json, "techniques", "/v1/techniques");
    pen_json_string(&json, "scenes", "/v1/scenes");
    pen_json_string(&json, "images", "/v1/images");
    pen_json_string(&json, "jobs", "/v1/jobs");
    pen_json_string(&json, "stats", "/v1/stats");
    pen_json_string(&json, "events", "/v1/events");
    pen_json_end(&json);
    pen_json_end(&json);
    http_add_header(call->exchange, "Cache-Control", "no-store");
    return call_json(call, 200, pen_json_finish(&json, NULL));
}
