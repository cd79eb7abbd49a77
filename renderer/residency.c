#include "renderer/residency.h"
#include "renderer/gl/release.h"
#include "renderer/passes/draw/kept_sums.h"
#include "renderer/passes/filter/history.h"
#include "renderer/passes/map/shadow_cache.h"
#include <assert.h>
#include <string.h>

#define SESSION_IDLE_MS 60e3
#define MOST_ABOVE (32u << 20)     /* the budget: programs and the like, which cannot be refused */
#define RELEASED_BYTES (32u << 20) /* deleted: less is not worth the time */
#define OWN_PROGRAM_BYTES (32u << 20) /* of programs that the budget does not count */

struct scene *residency_find(const struct residency *r, const uint8_t id[PEN_ID_BYTES])
{
    for (uint32_t i = 0; i < r->scene_count; i++)
        if (!memcmp(r->scenes[i]->id, id, PEN_ID_BYTES))
            return r->scenes[i];
    return NULL;
}

static uint64_t scene_bytes(const struct residency *r)
{
    uint64_t bytes = 0;
    for (uint32_t i = 0; i < r->scene_count; i++)
        bytes += r->scenes[i]->bytes;
    return bytes;
}

/* Where the processor draws, programs are its code and lie in the memory that textures have. */
static uint64_t program_bytes(const struct residency *r)
{
    uint64_t bytes = gl_programs_counts(r->ctx->programs).bytes;
    return r->ctx->software && bytes > OWN_PROGRAM_BYTES ? bytes - OWN_PROGRAM_BYTES : 0;
}

static uint64_t cached_bytes(const struct residency *r)
{
    return scene_bytes(r) + r->loading.bytes - r->loaded + program_bytes(r) +
           shadow_cache_bytes(r->ctx->shadows) + emission_cache_bytes(r->emissions) +
           history_store_bytes(r->ctx->histories) + kept_sums_store_bytes(r->ctx->kept_sums);
}

uint64_t residency_bytes(const struct residency *r)
{
    uint64_t bytes = cached_bytes(r);
    for (uint32_t i = 0; i < r->share_count; i++)
        bytes += r->shares[i]->targets.bytes;
    return bytes;
}

uint64_t residency_claimed(const struct residency *r)
{
    uint64_t bytes = cached_bytes(r);
    for (uint32_t i = 0; i < r->share_count; i++) {
        const struct residency_share *share = r->shares[i];
        bool more = share->lane->busy && share->need > share->targets.bytes;
        bytes += more ? share->need : share->targets.bytes;
    }
    return bytes;
}

/* A frame in progress reads it. */
static bool is_read(const struct residency *r, const struct scene *scene)
{
    for (uint32_t i = 0; i < r->share_count; i++) {
        const struct lane *lane = r->shares[i]->lane;
        if (!lane->busy)
            continue;
        const struct pen_request *request = &lane->result->completed;
        if (lane->job.scene == scene)
            return true;
        for (uint32_t k = 0; k < request->light_count; k++)
            if (request->lights[k].texture == PEN_TEXTURE_IMAGE &&
                !memcmp(request->lights[k].image, scene->id, PEN_ID_BYTES))
                return true;
    }
    return false;
}

static bool is_used(const struct residency *r, const struct scene *scene)
{
    for (uint32_t i = 0; i < r->wanted_count; i++)
        if (!memcmp(r->wanted[i], scene->id, PEN_ID_BYTES))
            return true;
    return is_read(r, scene);
}

static void remove_scene(struct residency *r, uint32_t i)
{
    shadow_cache_drop_scene(r->ctx->shadows, r->scenes[i]);
    emission_cache_drop(r->emissions, r->scenes[i]->id);
    kept_sums_store_drop(r->ctx->kept_sums, r->scenes[i]->id);
    uint64_t bytes = r->scenes[i]->bytes, images = r->loading.bytes;
    scene_destroy(r->scenes[i]);
    images -= r->loading.bytes;
    r->loaded -= images;
    gl_deleted_add(bytes - images); /* which have been added */
    r->scenes[i] = r->scenes[--r->scene_count];
}

bool residency_is_any_busy(const struct residency *r)
{
    for (uint32_t i = 0; i < r->share_count; i++)
        if (r->shares[i]->lane->busy)
            return true;
    return false;
}

/* Frees something that can be made again, the cheapest first: sums that somebody may ask more of,
 * targets that nobody draws into, shadow inputs, sessions, emission textures, scenes, hierarchies for
 * rays. False: all that is left is in use. */
static bool evict(struct residency *r, uint64_t bytes, const struct scene *keep)
{
    uint64_t least = UINT64_MAX, before = kept_sums_store_bytes(r->ctx->kept_sums);
    kept_sums_store_trim(r->ctx->kept_sums, before > bytes ? before - bytes : 0);
    if (kept_sums_store_bytes(r->ctx->kept_sums) < before)
        return true;
    for (uint32_t i = 0; i < r->share_count; i++) {
        struct residency_share *share = r->shares[i];
        if (!share->lane->busy && share->lane->states && share->targets.bytes) {
            lane_finish(share->lane);
            return true;
        }
    }
    before = shadow_cache_bytes(r->ctx->shadows);
    shadow_cache_trim(r->ctx->shadows, before > bytes ? before - bytes : 0);
    if (shadow_cache_bytes(r->ctx->shadows) < before)
        return true;
    before = history_store_bytes(r->ctx->histories);
    history_store_trim(r->ctx->histories, before > bytes ? before - bytes : 0);
    if (history_store_bytes(r->ctx->histories) < before)
        return true;
    before = emission_cache_bytes(r->emissions);
    if (before && !residency_is_any_busy(r)) {
        emission_cache_trim(r->emissions, 0);
        return true;
    }
    uint32_t oldest = UINT32_MAX;
    for (uint32_t i = 0; i < r->scene_count; i++)
        if (r->scenes[i] != keep && r->scenes[i]->last_use < least && !is_used(r, r->scenes[i]))
            least = r->scenes[i]->last_use, oldest = i;
    if (oldest != UINT32_MAX) {
        remove_scene(r, oldest);
        return true;
    }
    for (uint32_t i = 0; i < r->scene_count; i++)
        if (!is_read(r, r->scenes[i]) && scene_shed(r->scenes[i]))
            return true;
    return false;
}

/* What was deleted is gone from a software device, too, where it would not fit beside so many bytes. */
static void release(const struct residency *r, uint64_t bytes)
{
    uint64_t deleted = gl_deleted_bytes();
    if (r->ctx->software && deleted >= RELEASED_BYTES && bytes + deleted > r->budget)
        gl_release();
}

bool residency_make_room(struct residency *r, uint64_t more, const struct scene *keep)
{
    for (;;) {
        uint64_t bytes = residency_claimed(r) + more;
        bool fits = bytes <= r->budget && r->scene_count < MOST_SCENES;
        if (fits || !evict(r, bytes > r->budget ? bytes - r->budget : 0, keep)) {
            release(r, bytes);
            return fits;
        }
    }
}

static bool load(struct residency *r, struct scene *scene, struct pen_error *error)
{
    if (!scene)
        return false;
    if (scene->bytes > r->budget) {
        pen_fail(error, PEN_TOO_BIG, "",
            "The scene needs %.0f MiB of GPU memory; %.0f MiB are allowed.",
            (double)scene->bytes / (1 << 20), (double)r->budget / (1 << 20));
        scene_destroy(scene);
        return false;
    }
    scene->last_use = ++r->clock;
    r->scenes[r->scene_count++] = scene;
    r->loaded = r->loading.bytes;
    residency_make_room(r, 0, scene);
    return true;
}

bool residency_load(
    struct residency *r, const uint8_t id[PEN_ID_BYTES], int fd, struct pen_error *error)
{
    if (residency_find(r, id))
        return true;
    struct gl_account *before = gl_textures_charge(&r->loading);
    bool ok = load(r, scene_create(id, fd, error), error);
    gl_textures_charge(before);
    r->loaded = r->loading.bytes;
    return ok;
}

void residency_drop(struct residency *r, const uint8_t id[PEN_ID_BYTES])
{
    for (uint32_t i = 0; i < r->scene_count; i++)
        if (!memcmp(r->scenes[i]->id, id, PEN_ID_BYTES)) {
            if (is_used(r, r->scenes[i]))
                r->scenes[i]->last_use = 0; /* the first to be evicted */
            else
                remove_scene(r, i);
            return;
        }
}

/* What will be free when all other frames have ended: their targets, inputs and scenes. */
static uint64_t bytes_beside(const struct residency *r, const struct residency_share *own)
{
    uint64_t bytes = shadow_cache_bytes_beside(r->ctx->shadows, own->lane->ctx.lane);
    for (uint32_t i = 0; i < r->share_count; i++)
        if (r->shares[i] != own && r->shares[i]->lane->busy)
            bytes += r->shares[i]->need > r->shares[i]->targets.bytes ? r->shares[i]->need
                                                                      : r->shares[i]->targets.bytes;
    for (uint32_t i = 0; i < r->scene_count; i++)
        if (r->scenes[i] != own->lane->job.scene)
            bytes += r->scenes[i]->bytes;
    return bytes;
}

/* A frame that would not fit if it had all to itself is to end (passes/draw/turn.h). */
static bool room_for_frame(struct residency *r, uint64_t bytes)
{
    if (residency_make_room(r, bytes, NULL) || !r->drawing)
        return true;
    uint64_t needed = residency_claimed(r) + bytes - bytes_beside(r, r->drawing);
    struct technique_turns *turns = &r->drawing->lane->ctx.turns;
    if (needed <= r->budget + MOST_ABOVE || turns->held)
        return true;
    turns->needed_bytes = needed;
    return false;
}

static bool room_for_more(void *owner, uint64_t bytes)
{
    return room_for_frame(owner, bytes);
}

/* A program is there when it asks, and is not refused. */
static bool room_for_program(void *owner, uint64_t bytes)
{
    return residency_make_room(owner, bytes, NULL);
}

/* What was expected of a render is claimed already. */
static bool room_for_targets(void *owner, uint64_t bytes)
{
    struct residency_share *share = owner;
    uint64_t need = share->lane->busy ? share->need : 0, have = share->targets.bytes;
    uint64_t expected = need > have ? need - have : 0;
    return bytes <= expected || room_for_frame(share->residency, bytes - expected);
}

void residency_start(struct residency *r, struct technique_ctx *ctx, uint64_t budget,
    uint32_t most_programs, double session_idle_ms)
{
    *r = (struct residency){.ctx = ctx, .budget = budget, .loading = {0, room_for_more, r}};
    ctx->gpu_memory = budget;
    ctx->shadow_memory = budget / 4;
    ctx->programs = gl_programs_create(
        most_programs, ctx->software ? OWN_PROGRAM_BYTES + budget / 4 : 0, room_for_program, r);
    ctx->shadows = shadow_cache_create(room_for_more, r);
    ctx->histories =
        history_store_create(budget / 4, session_idle_ms > 0 ? session_idle_ms : SESSION_IDLE_MS);
    ctx->kept_sums = kept_sums_store_create(budget / 8);
    r->emissions = emission_cache_create();
}

void residency_share_start(struct residency *r, struct residency_share *share, struct lane *lane)
{
    *share = (struct residency_share){
        .residency = r, .lane = lane, .targets = {0, room_for_targets, share}};
    assert(r->share_count < SHADOW_CACHE_LANES);
    r->shares[r->share_count++] = share;
}

void residency_stop(struct residency *r)
{
    for (uint32_t i = 0; i < r->scene_count; i++)
        scene_destroy(r->scenes[i]);
    shadow_cache_destroy(r->ctx->shadows);
    history_store_destroy(r->ctx->histories);
    kept_sums_store_destroy(r->ctx->kept_sums);
    emission_cache_destroy(r->emissions);
    gl_programs_destroy(r->ctx->programs);
    gl_release_finish();
}

void residency_rest_others(struct residency *r, const struct scene *scene)
{
    for (uint32_t i = 0; i < r->scene_count; i++)
        if (r->scenes[i] != scene && !is_used(r, r->scenes[i]))
            scene_rest(r->scenes[i]);
}
