#include "renderer/passes/map/shadow_cache.h"
#include "protocol/memory.h"
#include <stdlib.h>
#include <string.h>

/* An input that one frame has used, so many frames ago, is taken for one whose light has moved on, when
 * those that no frame in progress uses have such a share of the memory. */
#define OLD_FRAMES 8
#define KEPT_SHARE 8

/* What of a face and a request changes a shadow input: everything but the view and the emission. */
struct face_key {
    mat4 world_to_light;
    float rect[4], half[2], range[2], cone;
    int32_t shape, parallel, cube;
    uint32_t casters; /* of the request */
};

struct entry {
    struct entry *next;
    const struct scene *scene;
    struct scene_pose pose;
    struct face_key face;
    struct shadow_key key;
    struct shadow_input input;
    uint64_t bytes, last_use, first_frame, last_frame;
    uint32_t lanes; /* a bit for each whose frame uses it */
};

struct shadow_cache {
    struct entry *entries; /* most recently made first; a handful, so a list will do */
    uint64_t bytes, clock, frames;
    struct gl_account
        building; /* inputs that are not finished, and what is used up by making them */
    uint32_t built[SHADOW_CACHE_LANES]; /* in the frame of each lane */
};

struct shadow_cache *shadow_cache_create(
    bool (*make_room)(void *owner, uint64_t bytes), void *owner)
{
    struct shadow_cache *cache = pen_alloc_zero(1, sizeof *cache);
    cache->building = (struct gl_account){0, make_room, owner};
    return cache;
}

static void end_entry(
    struct shadow_cache *cache, struct entry *e, void (*end)(struct gl_texture *texture))
{
    for (int i = 0; i < SHADOW_INPUT_TEXTURES; i++)
        end(&e->input.textures[i]);
    cache->bytes -= e->bytes;
    free(e);
}

static void free_entry(struct shadow_cache *cache, struct entry *e)
{
    end_entry(cache, e, gl_texture_destroy);
}

void shadow_cache_destroy(struct shadow_cache *cache)
{
    if (!cache)
        return;
    while (cache->entries) {
        struct entry *e = cache->entries;
        cache->entries = e->next;
        free_entry(cache, e);
    }
    free(cache);
}

static void make_face_key(const struct light_face *face, uint32_t casters, struct face_key *key)
{
    memset(key, 0, sizeof *key);
    memcpy(key->world_to_light, face->world_to_light, sizeof key->world_to_light);
    memcpy(key->rect, face->rect, sizeof key->rect);
    memcpy(key->half, face->extent, sizeof key->half);
    key->range[0] = face->near_z, key->range[1] = face->far_z;
    key->cone = face->cone_cos;
    key->shape = face->shape, key->parallel = face->parallel, key->cube = face->cube;
    key->casters = casters;
}

static void use(struct shadow_cache *cache, struct entry *e, uint32_t lane)
{
    e->last_use = ++cache->clock;
    e->last_frame = cache->frames;
    e->lanes |= 1u << lane;
}

static bool is_alike(const struct shadow_key *a, const struct shadow_key *b)
{
    return a->size == b->size && a->of_centre == b->of_centre && !strcmp(a->kind, b->kind) &&
           !memcmp(a->extra, b->extra, sizeof a->extra);
}

/* A rasteriser in software gets new memory from the system for every map, which has to be cleared, and
 * takes longer than small maps take to be drawn. Where the light moves, a new input is made of the
 * textures of an old one. */
static void recycle_one(struct technique_run *run, const struct shadow_key *key)
{
    struct shadow_cache *cache = run->ctx->shadows;
    struct entry **oldest = NULL;
    uint64_t idle = 0;
    for (struct entry **at = &cache->entries; *at; at = &(*at)->next) {
        struct entry *e = *at;
        if (e->lanes)
            continue;
        idle += e->bytes;
        if (e->scene == run->scene && is_alike(&e->key, key) && e->first_frame == e->last_frame &&
            e->last_frame + OLD_FRAMES <= cache->frames &&
            (!oldest || e->last_use < (*oldest)->last_use))
            oldest = at;
    }
    if (!oldest || !run->ctx->software || idle <= run->ctx->gpu_memory / KEPT_SHARE)
        return;
    struct entry *e = *oldest;
    *oldest = e->next;
    end_entry(cache, e, gl_texture_recycle);
}

const struct shadow_input *shadow_cache_get(struct technique_run *run, const struct shadow_key *key,
    shadow_build build, struct pen_error *error)
{
    struct shadow_cache *cache = run->ctx->shadows;
    struct face_key face;
    make_face_key(run->face, run->request->casters, &face);
    if (key->of_centre)
        memset(face.half, 0, sizeof face.half);
    for (struct entry *e = cache->entries; e; e = e->next)
        if (e->scene == run->scene && !memcmp(&e->pose, &run->scene->pose, sizeof e->pose) &&
            is_alike(&e->key, key) && !memcmp(&e->face, &face, sizeof face)) {
            use(cache, e, run->ctx->lane);
            return &e->input;
        }
    recycle_one(run, key);
    struct entry *e = pen_alloc_zero(1, sizeof *e);
    e->scene = run->scene;
    e->pose = run->scene->pose;
    e->face = face;
    e->key = *key;
    e->first_frame = cache->frames;
    struct gl_account *before = gl_textures_charge(&cache->building);
    bool ok = build(run, key, &e->input, error);
    gl_textures_charge(before);
    gl_textures_forget();
    for (int i = 0; i < SHADOW_INPUT_TEXTURES; i++) {
        gl_texture_release_account(&e->input.textures[i]);
        e->bytes += e->input.textures[i].bytes;
    }
    cache->bytes += e->bytes;
    if (!ok) {
        free_entry(cache, e);
        return NULL;
    }
    use(cache, e, run->ctx->lane);
    cache->built[run->ctx->lane]++;
    e->next = cache->entries;
    cache->entries = e;
    return &e->input;
}

void shadow_cache_mark_built(const struct technique_ctx *ctx)
{
    ctx->shadows->built[ctx->lane]++;
}

uint64_t shadow_cache_bytes(const struct shadow_cache *cache)
{
    return cache->bytes + cache->building.bytes;
}

uint64_t shadow_cache_bytes_beside(const struct shadow_cache *cache, uint32_t lane)
{
    uint64_t bytes = 0;
    for (const struct entry *e = cache->entries; e; e = e->next)
        if (e->lanes && !(e->lanes >> lane & 1))
            bytes += e->bytes;
    return bytes;
}

void shadow_cache_trim(struct shadow_cache *cache, uint64_t bytes)
{
    while (shadow_cache_bytes(cache) > bytes) {
        struct entry **oldest = NULL;
        for (struct entry **at = &cache->entries; *at; at = &(*at)->next)
            if (!(*at)->lanes && (!oldest || (*at)->last_use < (*oldest)->last_use))
                oldest = at;
        if (!oldest)
            return;
        struct entry *e = *oldest;
        *oldest = e->next;
        free_entry(cache, e);
    }
}

void shadow_cache_drop_scene(struct shadow_cache *cache, const struct scene *scene)
{
    for (struct entry **at = &cache->entries; *at;) {
        struct entry *e = *at;
        if (e->scene != scene) {
            at = &e->next;
            continue;
        }
        *at = e->next;
        free_entry(cache, e);
    }
}

void shadow_cache_begin_frame(const struct technique_ctx *ctx)
{
    ctx->shadows->built[ctx->lane] = 0;
    ctx->shadows->frames++;
    shadow_cache_release(ctx);
}

void shadow_cache_release(const struct technique_ctx *ctx)
{
    for (struct entry *e = ctx->shadows->entries; e; e = e->next)
        e->lanes &= ~(1u << ctx->lane);
}

bool shadow_cache_all_reused(const struct technique_ctx *ctx)
{
    return ctx->shadows->built[ctx->lane] == 0;
}
