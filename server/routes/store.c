/* Scenes and emission images: uploading, listing, describing, removing. */
#include "protocol/json_writer.h"
#include "protocol/container.h"
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
    bool resident = kind == STORE_SCENES && worker_pool_is_resident(call->service->pool, id);
    return describe_stored(call->service->store, kind, id, resident, error);
}

/* ---- uploads ---- */

struct importing {
    struct call *call;
    struct import_task task;
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

static bool list(struct call *call, enum store_kind kind, const char *key, struct pen_error *error)
{
    struct scene_store *store = call->service->store;
    struct page page;
    if (!page_read(call, NULL, &page, error))
        return false;
    struct store_entry entries[PAGE_MOST + 1];
    uint32_t count =
        scene_store_list(store, kind, page.has_after ? page.after : NULL, entries, page.limit + 1);
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
    pen_json_uint(&json, "total", scene_store_count(store, kind));
    if (count > shown)
        page_write_next(&json, kind_paths[kind], NULL, &page, entries[shown - 1].id);
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

/* Who uploaded it lets go of it, and it goes when nobody is left. Who may do all takes it from all. */
static bool remove_entry(struct call *call, enum store_kind kind, struct pen_error *error)
{
    struct service *s = call->service;
    const uint8_t *id = call->address.id;
    bool all = call->grant.scopes & AUTH_ADMIN;
    struct store_entry entry;
    if (s->owners && scene_store_find(s->store, kind, id, &entry)) {
        if (!all && !owners_has(s->owners, id, call->grant.owner))
            return pen_fail(error, PEN_FORBIDDEN, "",
                "Only who uploaded it, or a token with \"admin\", may remove it.");
        if (owners_remove(s->owners, id, all ? 0 : call->grant.owner))
            goto gone;
    }
    if (!scene_store_remove(s->store, kind, id, error))
        return false;
    if (kind == STORE_SCENES)
        worker_pool_drop_scene(s->pool, id);
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
