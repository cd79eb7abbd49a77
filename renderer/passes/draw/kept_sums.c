#include "renderer/passes/draw/kept_sums.h"
#include "protocol/memory.h"
#include <stdlib.h>
#include <string.h>

struct entry {
    struct entry *next;
    uint32_t frame, light, face;
    struct kept_sum kept;
};

struct kept_sums {
    struct pen_request key;
    struct entry *first; /* a handful, so a list will do */
    bool busy;
    uint64_t last_use, room, taken;
};

struct kept_sums_store {
    struct kept_sums *items[KEPT_SUMS_MOST];
    uint32_t count;
    uint64_t most_bytes, clock;
};

struct kept_sums_store *kept_sums_store_create(uint64_t most_bytes)
{
    struct kept_sums_store *store = pen_alloc_zero(1, sizeof *store);
    store->most_bytes = most_bytes;
    return store;
}

static uint64_t bytes_of(const struct kept_sums *sums)
{
    uint64_t bytes = 0;
    for (const struct entry *e = sums->first; e; e = e->next)
        bytes += e->kept.bytes + e->kept.sum.texture.bytes;
    return bytes;
}

uint64_t kept_sums_store_bytes(const struct kept_sums_store *store)
{
    uint64_t bytes = 0;
    for (uint32_t i = 0; i < store->count; i++)
        bytes += bytes_of(store->items[i]);
    return bytes;
}

static void remove_item(struct kept_sums_store *store, uint32_t i)
{
    struct kept_sums *sums = store->items[i];
    while (sums->first) {
        struct entry *e = sums->first;
        sums->first = e->next;
        gl_target_destroy(&e->kept.sum);
        if (e->kept.own)
            e->kept.destroy(e->kept.own);
        free(e);
    }
    free(sums);
    store->items[i] = store->items[--store->count];
}

void kept_sums_store_destroy(struct kept_sums_store *store)
{
    if (!store)
        return;
    while (store->count)
        remove_item(store, store->count - 1);
    free(store);
}

static bool remove_oldest(struct kept_sums_store *store)
{
    uint32_t oldest = UINT32_MAX;
    for (uint32_t i = 0; i < store->count; i++)
        if (!store->items[i]->busy &&
            (oldest == UINT32_MAX || store->items[i]->last_use < store->items[oldest]->last_use))
            oldest = i;
    if (oldest == UINT32_MAX)
        return false;
    remove_item(store, oldest);
    return true;
}

void kept_sums_store_trim(struct kept_sums_store *store, uint64_t bytes)
{
    while (kept_sums_store_bytes(store) > bytes && remove_oldest(store))
        ;
}

static bool has_id(const struct pen_request *key, const uint8_t id[PEN_ID_BYTES])
{
    bool found = !memcmp(key->scene, id, PEN_ID_BYTES);
    for (uint32_t i = 0; i < key->light_count; i++)
        found |= key->lights[i].texture == PEN_TEXTURE_IMAGE &&
                 !memcmp(key->lights[i].image, id, PEN_ID_BYTES);
    return found;
}

void kept_sums_store_drop(struct kept_sums_store *store, const uint8_t id[PEN_ID_BYTES])
{
    for (uint32_t i = store->count; i-- > 0;)
        if (!store->items[i]->busy && has_id(&store->items[i]->key, id))
            remove_item(store, i);
}

static void make_key(struct pen_request *key, const struct pen_request *request,
    const struct pen_technique_info *info)
{
    const struct pen_param *samples = pen_param_find(info->params, "samples");
    double none = samples->min;
    *key = *request;
    memset(&key->delivery, 0, sizeof key->delivery);
    key->output = (struct pen_output){.layer = request->output.layer};
    pen_param_store(samples, key->technique_params, &none, "", NULL);
}

struct kept_sums *kept_sums_open(struct kept_sums_store *store, const struct pen_request *request,
    const struct pen_technique_info *info, uint64_t room)
{
    struct pen_request key;
    struct kept_sums *sums = NULL;
    make_key(&key, request, info);
    for (uint32_t i = 0; i < store->count && !sums; i++)
        if (!memcmp(&store->items[i]->key, &key, PEN_REQUEST_KEY_BYTES))
            sums = store->items[i];
    if (sums && sums->busy)
        return NULL;
    if (!sums) {
        if (store->count == KEPT_SUMS_MOST && !remove_oldest(store))
            return NULL;
        sums = store->items[store->count++] = pen_alloc_zero(1, sizeof *sums);
        sums->key = key;
    }
    sums->busy = true;
    sums->room = room;
    sums->taken = 0;
    return sums;
}

void kept_sums_close(struct kept_sums_store *store, struct kept_sums *sums)
{
    if (!sums)
        return;
    sums->busy = false;
    sums->last_use = ++store->clock;
}

uint64_t kept_sums_taken(const struct kept_sums *sums)
{
    return sums ? sums->taken : 0;
}

static struct entry *find(const struct technique_run *run, uint32_t face)
{
    struct entry *e = run->sums->first;
    while (e && (e->frame != run->frame || e->light != run->light_index || e->face != face))
        e = e->next;
    return e;
}

static struct entry *make(struct technique_run *run, uint32_t face, uint64_t bytes)
{
    struct kept_sums_store *store = run->ctx->kept_sums;
    struct kept_sums *sums = run->sums;
    if (bytes > sums->room || bytes > store->most_bytes)
        return NULL;
    kept_sums_store_trim(store, store->most_bytes - bytes);
    if (kept_sums_store_bytes(store) + bytes > store->most_bytes)
        return NULL;
    sums->room -= bytes;
    struct entry *e = pen_alloc_zero(1, sizeof *e);
    e->frame = run->frame;
    e->light = run->light_index;
    e->face = face;
    e->next = sums->first;
    sums->first = e;
    return e;
}

struct kept_sum *kept_sum_open(
    struct technique_run *run, uint32_t most, uint32_t faces, uint64_t bytes)
{
    if (!run->sums)
        return NULL;
    uint32_t face = (uint32_t)(run->face - run->light->faces);
    struct entry *e = find(run, face);
    if (!e)
        e = make(run, face, bytes);
    if (!e || e->kept.samples > most)
        return NULL;
    run->sums->taken += (uint64_t)e->kept.samples * faces;
    return &e->kept;
}

const struct gl_target *kept_sum_target(struct technique_run *run, struct kept_sum *kept)
{
    static const float zero[4] = {0};
    if (gl_target_fit(&kept->sum, GL_RGBA32F, run->width, run->height, 0, 1))
        gl_texture_release_account(&kept->sum.texture); /* bytes_of() counts it */
    if (!kept->samples)
        gl_target_clear(&kept->sum, zero);
    return &kept->sum;
}
