/* Scenes and emission images: uploading, listing, describing, removing. */
#include "protocol/json_request.h"
#include "protocol/json_writer.h"
#include "server/base/container.h"
#include "server/store/describe.h"
#include "server/routes/routes.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#define DEFAULT_PAGE 50
#define MAX_PAGE 200
#define BUSY_S 2 /* until another upload may find room */

static enum store_kind kind_of(const struct call *call)
{
    switch (call->route) {
    case PEN_ROUTE_IMAGES:
    case PEN_ROUTE_IMAGE_POST:
    case PEN_ROUTE_IMAGE:
    case PEN_ROUTE_IMAGE_PUT:
    case PEN_ROUTE_IMAGE_DELETE:
        return STORE_IMAGES;
    default:
        return STORE_SCENES;
    }
}

static const char *const kind_paths[STORE_KINDS] = {"/v1/scenes", "/v1/images"};

static bool takes_type(enum store_kind kind, const char *type)
{
    static const char *const types[STORE_KINDS][8] = {
        {"model/gltf-binary", "model/gltf+json", "application/zip", "application/x-zip-compressed",
            "multipart/form-data", "application/octet-stream"},
        {"image/png", "image/jpeg", "image/webp", "multipart/form-data",
            "application/octet-stream"}};
    size_t bytes = strcspn(type, "; \t");
    for (int i = 0; types[kind][i]; i++)
        if (strlen(types[kind][i]) == bytes && !strncasecmp(types[kind][i], type, bytes))
            return true;
    return false;
}

bool routes_begin_upload(struct call *call)
{
    struct service *s = call->service;
    const struct http_exchange *x = call->exchange;
    const char *type = http_header(x, "Content-Type");
    uint64_t limit = s->config->upload_limit.bytes;
    struct pen_error error = {0};
    if (service_is_draining(s))
        pen_fail(&error, PEN_UNAVAILABLE, "", "The service is shutting down.");
    else if (!type || !takes_type(kind_of(call), type))
        pen_fail(&error, PEN_UNKNOWN_TYPE, "",
            kind_of(call) == STORE_SCENES
                ? "A scene is model/gltf-binary, model/gltf+json, application/zip or "
                  "multipart/form-data."
                : "An image is image/png, image/jpeg or image/webp.");
    else if (x->content_length != HTTP_UNKNOWN_LENGTH && x->content_length > limit)
        pen_fail(&error, PEN_TOO_BIG, "", "An upload has at most %llu bytes.",
            (unsigned long long)limit);
    if (error.code == PEN_OK) {
        call->counts_as_upload = true;
        if (__atomic_add_fetch(&s->uploads, 1, __ATOMIC_ACQ_REL) > s->config->uploads)
            pen_fail(&error, PEN_UNAVAILABLE, "", "Too many uploads are under way.");
        else
            call->upload = upload_create(s->store, type, limit, &error);
    }
    if (error.code == PEN_OK)
        return true;
    error.retry_after_s = BUSY_S;
    routes_fail(call, &error);
    return false;
}

/* The stored document, with what has become of the scene since it was written. */
static char *describe(struct call *call, const uint8_t id[PEN_ID_BYTES], struct pen_error *error)
{
    static const char at_import[] = "\"resident\":false,", now[] = "\"resident\":true, ";
    char *text = describe_stored(call->service->store, kind_of(call), id, error);
    /* Inside a name the quotes would be escaped: only the member itself can match. */
    char *member = text && kind_of(call) == STORE_SCENES ? strstr(text, at_import) : NULL;
    if (member && worker_pool_is_resident(call->service->pool, id))
        memcpy(member, now, sizeof now - 1);
    return text;
}

/* An importer's thread. */
static void finish(struct import_task *task)
{
    struct call *call = container_of(task, struct call, task);
    char hex[PEN_ID_HEX + 1];
    char *text = NULL;
    if (task->error.code == PEN_OK)
        text = describe(call, task->id, &task->error);
    if (!text) {
        task->error.retry_after_s = BUSY_S;
        routes_fail(call, &task->error);
        return;
    }
    pen_id_to_hex(task->id, hex);
    http_add_header(call->exchange, "Location", "%s/%s", kind_paths[task->kind], hex);
    routes_json(call, task->added ? 201 : 200, text);
}

void routes_import(struct call *call)
{
    struct pen_error error = {0};
    struct import_task *task = &call->task;
    task->upload = call->upload;
    task->kind = kind_of(call);
    task->expects_id = call->route == PEN_ROUTE_SCENE_PUT || call->route == PEN_ROUTE_IMAGE_PUT;
    memcpy(task->id, call->id, PEN_ID_BYTES);
    task->finish = finish;
    call->upload = NULL; /* the task's from here on */
    http_defer(call->exchange);
    if (!importer_submit(call->service->importer, task, &error)) {
        call->upload = task->upload;
        error.retry_after_s = BUSY_S;
        routes_fail(call, &error);
    }
}

/* limit and after. */
static bool read_page(struct call *call, uint32_t *limit, uint8_t after[PEN_ID_BYTES],
    bool *has_after, struct pen_error *error)
{
    struct pen_query_pair pairs[ROUTES_MAX_PAIRS];
    uint32_t count;
    if (!routes_split_query(call->exchange->query, pairs, &count, error))
        return false;
    for (uint32_t i = 0; i < count; i++) {
        const char *value = pairs[i].value ? pairs[i].value : "";
        if (!strcmp(pairs[i].key, "limit")) {
            char *end;
            unsigned long n = strtoul(value, &end, 10);
            if (*value < '0' || *value > '9' || *end || n < 1 || n > MAX_PAGE)
                return pen_fail(error, PEN_INVALID, "/limit",
                    "limit must be a whole number from 1 to %d.", MAX_PAGE);
            *limit = (uint32_t)n;
        } else if (!strcmp(pairs[i].key, "after")) {
            if (!(*has_after = pen_id_from_hex(value, after)))
                return pen_fail(error, PEN_INVALID, "/after", "after must be an id.");
        } else {
            return pen_fail(error, PEN_INVALID, "", "A list takes only the keys limit and after.");
        }
    }
    return true;
}

void routes_list(struct call *call)
{
    struct scene_store *store = call->service->store;
    enum store_kind kind = kind_of(call);
    struct pen_error error = {0};
    uint32_t limit = DEFAULT_PAGE;
    uint8_t after[PEN_ID_BYTES];
    bool has_after = false;
    if (!read_page(call, &limit, after, &has_after, &error)) {
        routes_fail(call, &error);
        return;
    }
    struct store_entry entries[MAX_PAGE + 1];
    uint32_t count = scene_store_list(store, kind, has_after ? after : NULL, entries, limit + 1);
    uint32_t shown = count > limit ? limit : count;
    struct pen_json json = {0};
    pen_json_object(&json, NULL);
    pen_json_array(&json, kind == STORE_SCENES ? "scenes" : "images");
    for (uint32_t i = 0; i < shown; i++) {
        struct pen_error gone = {0};
        char *text = describe(call, entries[i].id, &gone);
        if (text) /* deleted meanwhile: left out */
            pen_json_raw(&json, NULL, text);
        free(text);
    }
    pen_json_end(&json);
    pen_json_uint(&json, "total", scene_store_count(store, kind));
    if (count > limit) {
        char next[PEN_ID_HEX + 64], hex[PEN_ID_HEX + 1];
        pen_id_to_hex(entries[limit - 1].id, hex);
        snprintf(next, sizeof next, "%s?limit=%u&after=%s", kind_paths[kind], limit, hex);
        pen_json_string(&json, "next", next);
    }
    pen_json_end(&json);
    routes_json(call, 200, pen_json_finish(&json, NULL));
}

void routes_describe(struct call *call)
{
    struct pen_error error = {0};
    char *text = describe(call, call->id, &error);
    if (text)
        routes_json(call, 200, text);
    else
        routes_fail(call, &error);
}

void routes_delete(struct call *call)
{
    struct pen_error error = {0};
    enum store_kind kind = kind_of(call);
    if (!scene_store_remove(call->service->store, kind, call->id, &error)) {
        routes_fail(call, &error);
        return;
    }
    if (kind == STORE_SCENES)
        worker_pool_drop_scene(call->service->pool, call->id);
    http_answer(call->exchange, 204, NULL, http_static(NULL, 0));
}
