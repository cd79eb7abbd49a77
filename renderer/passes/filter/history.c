#include "renderer/passes/filter/history.h"
#include "protocol/memory.h"
#include "renderer/passes/map/shadow_cache.h"
#include <assert.h>
#include <stdlib.h>
#include <string.h>

/* What the frames of a sequence have in common; equal bit by bit. */
struct setup {
    uint8_t scene[PEN_ID_BYTES];
    uint32_t params[PEN_TECHNIQUE_PARAM_BYTES / 4];
    struct pen_light lights[PEN_MAX_LIGHTS];
    uint32_t light_count, width, height, casters, ground;
    int32_t variant;
    float time_s;     /* of emission that changes with time */
    double origin[3]; /* that places are relative to */
};

struct history {
    uint32_t owner[2];
    char name[PEN_NAME_BYTES];
    uint64_t last_use;
    double last_ms;
    bool busy;
    uint32_t frames, samples; /* that `set` rests on: requests, light samples */
    struct setup setup;
    struct scene_pose pose;
    struct history_set set;
    bool has_key_view;
    uint8_t key_scene[PEN_ID_BYTES];
    struct view key_view;
    /* Of the frame in progress: */
    struct history_set *room; /* two, in turns for jittered frames */
    bool fits, moved;
    uint32_t begun, per_frame; /* jittered frames; light samples of each */
    struct scene_pose now;
    struct setup asked;
};

struct history_store {
    struct history *items[HISTORY_MOST];
    uint32_t count;
    struct history_set rooms[SHADOW_CACHE_LANES][2]; /* each lane draws into its own */
    uint64_t bytes, most_bytes, clock;
    double idle_ms;
};

static uint64_t layer_bytes(uint32_t width, uint32_t height)
{
    return 32 * (uint64_t)width * height;
}

static void free_set(struct history_store *store, struct history_set *set)
{
    for (uint32_t i = 0; i < PEN_MAX_LIGHTS; i++) {
        struct history_layer *layer = &set->layers[i];
        if (!layer->framebuffer)
            continue;
        store->bytes -= layer_bytes(layer->mean.width, layer->mean.height);
        gl.DeleteFramebuffers(1, &layer->framebuffer);
        gl_texture_destroy(&layer->mean);
        gl_texture_destroy(&layer->state);
    }
    memset(set, 0, sizeof *set);
}

static void fit_set(
    struct history_store *store, struct history_set *set, uint32_t width, uint32_t height)
{
    if (set->width == width && set->height == height)
        return;
    free_set(store, set);
    set->width = width, set->height = height;
}

static void fit_layer(struct history_store *store, struct history_set *set, uint32_t light)
{
    struct history_layer *layer = &set->layers[light];
    if (layer->framebuffer)
        return;
    layer->mean = gl_texture_create(GL_RGBA32F, set->width, set->height, 0, 1);
    layer->state = gl_texture_create(GL_RGBA32F, set->width, set->height, 0, 1);
    gl_texture_release_account(&layer->mean); /* layer_bytes() counts them */
    gl_texture_release_account(&layer->state);
    const struct gl_texture *colors[] = {&layer->mean, &layer->state};
    layer->framebuffer = gl_framebuffer_create(colors, 2, NULL);
    store->bytes += layer_bytes(set->width, set->height);
}

struct history_store *history_store_create(uint64_t most_bytes, double idle_ms)
{
    struct history_store *store = pen_alloc_zero(1, sizeof *store);
    store->most_bytes = most_bytes;
    store->idle_ms = idle_ms;
    return store;
}

static void remove_item(struct history_store *store, uint32_t i)
{
    free_set(store, &store->items[i]->set);
    free(store->items[i]);
    store->items[i] = store->items[--store->count];
}

void history_store_destroy(struct history_store *store)
{
    if (!store)
        return;
    while (store->count)
        remove_item(store, store->count - 1);
    for (uint32_t i = 0; i < SHADOW_CACHE_LANES; i++)
        for (int k = 0; k < 2; k++)
            free_set(store, &store->rooms[i][k]);
    free(store);
}

uint64_t history_store_bytes(const struct history_store *store)
{
    return store->bytes;
}

uint32_t history_store_count(const struct history_store *store)
{
    return store->count;
}

/* The one that was not used for longest, of one owner or (NULL) of all; UINT32_MAX: none. */
static uint32_t find_oldest(const struct history_store *store, const uint32_t *owner)
{
    uint32_t oldest = UINT32_MAX;
    uint64_t least = UINT64_MAX;
    for (uint32_t i = 0; i < store->count; i++) {
        const struct history *h = store->items[i];
        if (h->busy || (owner && memcmp(h->owner, owner, sizeof h->owner)) || h->last_use >= least)
            continue;
        least = h->last_use;
        oldest = i;
    }
    return oldest;
}

static bool lane_is_busy(const struct history_store *store, uint32_t lane)
{
    for (uint32_t i = 0; i < store->count; i++)
        if (store->items[i]->busy && store->items[i]->room == store->rooms[lane])
            return true;
    return false;
}

void history_store_trim(struct history_store *store, uint64_t bytes)
{
    uint64_t most = bytes < store->most_bytes ? bytes : store->most_bytes;
    double since_ms = gl_now_ms() - store->idle_ms;
    for (uint32_t i = store->count; i-- > 0;)
        if (!store->items[i]->busy && store->items[i]->last_ms < since_ms)
            remove_item(store, i);
    if (store->bytes <= most && store->count)
        return;
    for (uint32_t i = 0; i < SHADOW_CACHE_LANES; i++)
        for (int k = 0; k < 2 && !lane_is_busy(store, i); k++)
            free_set(store, &store->rooms[i][k]);
    uint32_t oldest;
    while (store->bytes > most && (oldest = find_oldest(store, NULL)) != UINT32_MAX)
        remove_item(store, oldest);
}

static struct history *find(const struct history_store *store, const struct pen_delivery *delivery)
{
    for (uint32_t i = 0; i < store->count; i++) {
        struct history *h = store->items[i];
        if (!memcmp(h->owner, delivery->session_owner, sizeof h->owner) &&
            !strcmp(h->name, delivery->session))
            return h;
    }
    return NULL;
}

bool history_is_busy(const struct history_store *store, const struct pen_request *request)
{
    const struct history *h = find(store, &request->delivery);
    return request->delivery.session[0] && h && h->busy;
}

static void make_room(struct history_store *store, const uint32_t owner[2])
{
    uint32_t own = 0, oldest;
    for (uint32_t i = 0; i < store->count; i++)
        own += !memcmp(store->items[i]->owner, owner, 2 * sizeof *owner);
    if (own >= HISTORY_MOST_PER_OWNER && (oldest = find_oldest(store, owner)) != UINT32_MAX)
        remove_item(store, oldest);
    if (store->count == HISTORY_MOST && (oldest = find_oldest(store, NULL)) != UINT32_MAX)
        remove_item(store, oldest);
}

struct history *history_open(
    struct history_store *store, uint32_t lane, const struct pen_request *request)
{
    const struct pen_delivery *delivery = &request->delivery;
    assert(lane < SHADOW_CACHE_LANES);
    history_store_trim(store, UINT64_MAX);
    if (!delivery->session[0])
        return NULL;
    struct history *h = find(store, delivery);
    if (!h) {
        make_room(store, delivery->session_owner);
        if (store->count == HISTORY_MOST)
            return NULL;
        h = pen_alloc_zero(1, sizeof *h);
        memcpy(h->owner, delivery->session_owner, sizeof h->owner);
        memcpy(h->name, delivery->session, sizeof h->name);
        store->items[store->count++] = h;
    }
    h->busy = true;
    h->room = store->rooms[lane];
    h->begun = 0;
    return h;
}

void history_close(struct history_store *store, struct history *h, bool ok)
{
    if (!h)
        return;
    h->busy = false;
    h->last_use = ++store->clock;
    h->last_ms = gl_now_ms();
    if (ok && h->begun && h->fits) {
        struct history_set *left = &h->room[(h->begun - 1) & 1], before = h->set;
        h->set = *left;
        *left = before;
        h->frames++;
        h->samples += h->begun * h->per_frame;
        h->setup = h->asked;
        h->pose = h->now;
    }
}

const struct view *history_key_view(
    struct history *h, const struct pen_request *request, const struct view *view)
{
    if (!h)
        return view;
    if (!h->has_key_view || memcmp(h->key_scene, request->scene, PEN_ID_BYTES)) {
        h->has_key_view = true;
        h->key_view = *view;
        memcpy(h->key_scene, request->scene, PEN_ID_BYTES);
    }
    return &h->key_view;
}

static void fill_setup(const struct technique_run *run, struct setup *s)
{
    const struct pen_request *r = run->request;
    memset(s, 0, sizeof *s);
    memcpy(s->scene, r->scene, sizeof s->scene);
    memcpy(s->params, r->technique_params, sizeof s->params);
    memcpy(s->lights, r->lights, r->light_count * sizeof *r->lights);
    s->light_count = r->light_count;
    s->width = run->width, s->height = run->height;
    s->casters = r->casters;
    s->ground = r->ground.on != 0;
    s->variant = run->scene->pose.variant;
    memcpy(s->origin, run->scene->blob.header->origin, sizeof s->origin);
    for (uint32_t i = 0; i < r->light_count; i++)
        if (r->lights[i].texture != PEN_TEXTURE_NONE)
            s->time_s = r->time_s;
}

static bool is_same_pose(const struct scene_pose *a, const struct scene_pose *b)
{
    return a->animation == b->animation && a->time_s == b->time_s;
}

/* Of the first jittered frame. */
static void compare(struct technique_run *run)
{
    struct history *h = run->history;
    fill_setup(run, &h->asked);
    h->now = run->scene->pose;
    if (memcmp(&h->asked, &h->setup, sizeof h->setup) || !h->set.width)
        h->frames = h->samples = 0;
    h->moved = h->frames && !is_same_pose(&h->now, &h->pose);
    uint64_t bytes = run->request->light_count * layer_bytes(run->width, run->height);
    h->fits = 2 * bytes <= run->ctx->histories->most_bytes;
    if (!h->fits)
        pen_result_warn(
            run->result, "What a frame of this size leaves does not fit: it has no history.");
}

void history_begin(struct technique_run *run)
{
    struct history *h = run->history;
    if (!h)
        return;
    if (run->light_index == 0 && run->frame == 0)
        compare(run);
    if (!h->fits)
        return;
    struct history_set *next = &h->room[run->frame & 1];
    fit_set(run->ctx->histories, next, run->width, run->height);
    fit_layer(run->ctx->histories, next, run->light_index);
    next->view = *run->view;
    h->begun = run->frame + 1;
}

bool history_goes_on(const struct technique_run *run)
{
    return run->history && run->history->fits && run->history->begun == run->frame + 1;
}

const struct history_set *history_last(const struct technique_run *run)
{
    const struct history *h = run->history;
    const struct history_set *last = run->frame ? &h->room[(run->frame - 1) & 1] : &h->set;
    return run->frame || h->frames ? last : NULL;
}

const struct history_layer *history_next(const struct technique_run *run)
{
    return &run->history->room[run->frame & 1].layers[run->light_index];
}

uint32_t history_samples(const struct technique_run *run, uint32_t per_frame)
{
    run->history->per_frame = per_frame;
    return run->history->samples + run->frame * per_frame;
}

bool history_has_moved(const struct technique_run *run)
{
    return run->history->moved && run->frame == 0;
}

uint32_t history_frames(const struct technique_run *run)
{
    return run->history->frames;
}
