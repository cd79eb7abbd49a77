/* Scenes and emission images: uploading, listing, describing, removing. */
#include "protocol/json_writer.h"
#include "protocol/container.h"
#include "server/gallery/labels.h"
#include "server/http/query.h"
#include "server/routes/page.h"
#include "server/routes/routes.h"
#include "server/store/describe.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const kind_paths[STORE_KINDS] = {"/v1/scenes", "/v1/images"};

/* The stored document, with what has become of the scene since it was written. */
static char *describe(struct call *call, enum store_kind kind, const uint8_t id[PEN_ID_BYTES],
    struct pen_error *error)
{
    struct service *s = call->service;
    struct label label = {0};
    if (kind == STORE_SCENES)
        labels_get(s->labels, id, &label);
    char *text = label_json(&label);
    struct store_now now = {kind == STORE_SCENES && worker_pool_is_resident(s->pool, id), text};
    char *description = describe_stored(s->store, kind, id, &now, error);
    free(text);
    return description;
}

/* ---- uploads ---- */

struct importing {
    struct call *call;
    struct import_task task;
    char name[PEN_LABEL_NAME_BYTES]; /* of the scene, as it comes; "": nobody says */
};

/* An importer's thread. */
static void finish(struct import_task *task)
{
    struct importing *work = container_of(task, struct importing, task);
    task->error.retry_after_s = ROUTES_BUSY_S;
    call_resume(work->call, &task->error);
}

/* Waits for an importer. */
static enum step_end import(struct call *call, struct pen_error *error)
{
    struct importing *work = call->work;
    if (!*work->name)
        label_from_file(upload_name(call->body.upload), work->name);
    work->task.upload = call->body.upload; /* the task's from here on */
    call->body.upload = NULL;
    http_defer(call->exchange);
    if (importer_submit(call->service->importer, &work->task, error))
        return STEP_OVER;
    call->body.upload = work->task.upload;
    error->retry_after_s = ROUTES_BUSY_S;
    return STEP_FAILED;
}

static enum step_end answer(struct call *call, struct pen_error *error)
{
    const struct import_task *task = &((struct importing *)call->work)->task;
    struct owners *owners = call->service->owners;
    char hex[PEN_ID_HEX + 1];
    if (task->kind == STORE_SCENES)
        labels_settle(
            call->service->labels, task->id, ((struct importing *)call->work)->name, task->added);
    if (owners && !owners_add(owners, task->id, call->grant.owner, error))
        return STEP_FAILED;
    char *text = describe(call, task->kind, task->id, error);
    if (!text) {
        error->retry_after_s = ROUTES_BUSY_S;
        return STEP_FAILED;
    }
    pen_id_to_hex(task->id, hex);
    if (task->kind == STORE_SCENES)
        strcpy(call->note.scene, hex);
    http_add_header(
        call->exchange, "Location", "%s%s/%s", call->prefix, kind_paths[task->kind], hex);
    call_json(call, task->added ? 201 : 200, text);
    return STEP_OVER;
}

static const struct step steps[] = {
    {"import", import}, /* waits */
    {"answer", answer},
};

static bool upload(
    struct call *call, enum store_kind kind, bool expects_id, struct pen_error *error)
{
    struct importing *work = call_work(call, sizeof *work, NULL);
    work->call = call;
    work->task.kind = kind;
    work->task.expects_id = expects_id;
    work->task.finish = finish;
    memcpy(work->task.id, call->address.id, PEN_ID_BYTES);
    label_from_file(call->body.name, work->name);
    if (!*work->name && call->address.route->flags & PEN_ROUTE_NAMED) {
        char *file = strdup(call->exchange->path + strlen(call->address.route->pattern));
        if (http_decode(file, false))
            label_from_file(file, work->name);
        free(file);
    }
    return call_run(call, steps, error);
}

bool route_scene_post(struct call *call, struct pen_error *error)
{
    return upload(call, STORE_SCENES, false, error);
}

bool route_scene_put(struct call *call, struct pen_error *error)
{
    return upload(call, STORE_SCENES, true, error);
}

bool route_scene_send(struct call *call, struct pen_error *error)
{
    return upload(call, STORE_SCENES, false, error);
}

bool route_image_post(struct call *call, struct pen_error *error)
{
    return upload(call, STORE_IMAGES, false, error);
}

bool route_image_put(struct call *call, struct pen_error *error)
{
    return upload(call, STORE_IMAGES, true, error);
}

/* ---- lists ---- */

static const char *const scene_keys[] = {"name", "tag", NULL};

/* The entries of the page, and one more when there is another page; *total: all that fit. */
static uint32_t select_entries(struct call *call, enum store_kind kind, const struct page *page,
    struct store_entry entries[PAGE_MOST + 1], uint32_t *total)
{
    const struct service *s = call->service;
    const uint8_t *after = page->has_after ? page->after : NULL;
    if (!page_is_chosen(page)) {
        *total = scene_store_count(s->store, kind);
        return scene_store_list(s->store, kind, after, entries, page->limit + 1);
    }
    struct store_entry entry;
    uint8_t last[PEN_ID_BYTES];
    uint32_t count = 0;
    *total = 0;
    for (bool first = true; scene_store_list(s->store, kind, first ? NULL : last, &entry, 1);
         first = false) {
        struct label label;
        memcpy(last, entry.id, PEN_ID_BYTES);
        labels_get(s->labels, entry.id, &label);
        if (!label_fits(&label, page->values[0], page->values[1]))
            continue;
        ++*total;
        if ((!after || memcmp(entry.id, after, PEN_ID_BYTES) > 0) && count <= page->limit)
            entries[count++] = entry;
    }
    return count;
}

static bool list(struct call *call, enum store_kind kind, const char *key, struct pen_error *error)
{
    struct page page;
    if (!page_read(call, kind == STORE_SCENES ? scene_keys : NULL, &page, error))
        return false;
    struct store_entry entries[PAGE_MOST + 1];
    uint32_t total, count = select_entries(call, kind, &page, entries, &total);
    uint32_t shown = count > page.limit ? page.limit : count;
    struct pen_json json = {0};
    pen_json_object(&json, NULL);
    pen_json_array(&json, key);
    for (uint32_t i = 0; i < shown; i++) {
        struct pen_error gone = {0};
        char *text = describe(call, kind, entries[i].id, &gone);
        if (text) /* deleted meanwhile: left out */
            pen_json_raw(&json, NULL, text);
        free(text);
    }
    pen_json_end(&json);
    pen_json_uint(&json, "total", total);
    if (count > shown)
        page_write_next(&json, kind_paths[kind], scene_keys, &page, entries[shown - 1].id);
    pen_json_end(&json);
    return call_json(call, 200, pen_json_finish(&json, NULL));
}

bool route_scenes(struct call *call, struct pen_error *error)
{
    return list(call, STORE_SCENES, "scenes", error);
}

bool route_images(struct call *call, struct pen_error *error)
{
    return list(call, STORE_IMAGES, "images", error);
}

/* ---- one of them ---- */

bool route_scene(struct call *call, struct pen_error *error)
{
    char *text = describe(call, STORE_SCENES, call->address.id, error);
    return text && call_json(call, 200, text);
}

bool route_image(struct call *call, struct pen_error *error)
{
    char *text = describe(call, STORE_IMAGES, call->address.id, error);
    return text && call_json(call, 200, text);
}

static bool owns(struct call *call, const uint8_t *id)
{
    const struct service *s = call->service;
    return !s->owners || call->grant.scopes & AUTH_ADMIN ||
           owners_has(s->owners, id, call->grant.owner);
}

bool route_scene_patch(struct call *call, struct pen_error *error)
{
    struct service *s = call->service;
    const uint8_t *id = call->address.id;
    struct label label;
    size_t bytes;
    const char *text = body_json(&call->body, &bytes);
    if (!scene_store_find(s->store, STORE_SCENES, id, NULL))
        return pen_fail(error, PEN_NOT_FOUND, "", "There is no such scene.");
    if (!owns(call, id))
        return pen_fail(error, PEN_FORBIDDEN, "",
            "Only who uploaded it, or a token with \"admin\", may name it.");
    labels_get(s->labels, id, &label);
    return label_change(&label, text, bytes, error) && labels_set(s->labels, id, &label, error) &&
           route_scene(call, error);
}

/* Who uploaded it lets go of it, and it goes when nobody is left. Who may do all takes it from all. */
static bool remove_entry(struct call *call, enum store_kind kind, struct pen_error *error)
{
    struct service *s = call->service;
    const uint8_t *id = call->address.id;
    bool all = call->grant.scopes & AUTH_ADMIN;
    struct store_entry entry;
    if (s->owners && scene_store_find(s->store, kind, id, &entry)) {
        if (!owns(call, id))
            return pen_fail(error, PEN_FORBIDDEN, "",
                "Only who uploaded it, or a token with \"admin\", may remove it.");
        if (owners_remove(s->owners, id, all ? 0 : call->grant.owner))
            goto gone;
    }
    if (!scene_store_remove(s->store, kind, id, error))
        return false;
    if (kind == STORE_SCENES) {
        labels_forget(s->labels, id);
        worker_pool_drop_scene(s->pool, id);
    }
gone:
    http_answer(call->exchange, 204, NULL, http_static(NULL, 0));
    return true;
}

bool route_scene_delete(struct call *call, struct pen_error *error)
{
    return remove_entry(call, STORE_SCENES, error);
}

bool route_image_delete(struct call *call, struct pen_error *error)
{
    return remove_entry(call, STORE_IMAGES, error);
}
