/* What is there of scenes, shadow inputs, sums, sessions, programs and targets, under one budget, and
 * what goes when that is short. */
#pragma once
#include "renderer/lane.h"
#include "renderer/passes/map/shadow_cache.h"

#define MOST_SCENES 256

/* Of one lane. */
struct residency_share {
    struct residency *residency;
    struct lane *lane;
    struct gl_account targets; /* its own */
    uint64_t need;             /* what these are expected to come to, of its frame */
};

struct residency {
    struct technique_ctx *ctx; /* what lanes share: it has the stores */
    uint64_t budget, clock;    /* bytes; counts uses */
    struct residency_share *shares[SHADOW_CACHE_LANES];
    uint32_t share_count;
    struct scene *scenes[MOST_SCENES]; /* emission images too: scenes without geometry */
    uint32_t scene_count;
    struct residency_share *drawing; /* whose frame is going on, if any */
    struct gl_account loading; /* images of a scene that is being loaded, and of those that are */
    uint64_t loaded;           /* the part of it that scenes count */
    struct emission_cache *emissions;
    const uint8_t *const *wanted; /* scenes that a frame which is about to begin will read */
    uint32_t wanted_count;
};

/* Makes the stores, with ctx->software known. Not moved until residency_stop. most_programs: 0 for as
 * many as is usual; session_idle_ms: 0 for one minute. */
void residency_start(struct residency *r, struct technique_ctx *ctx, uint64_t budget,
    uint32_t most_programs, double session_idle_ms);
void residency_share_start(struct residency *r, struct residency_share *share, struct lane *lane);
void residency_stop(struct residency *r); /* lanes have finished */

struct scene *residency_find(const struct residency *r, const uint8_t id[PEN_ID_BYTES]);
/* As pen_renderer_load_scene has it. */
bool residency_load(
    struct residency *r, const uint8_t id[PEN_ID_BYTES], int fd, struct pen_error *error);
void residency_drop(struct residency *r, const uint8_t id[PEN_ID_BYTES]);
/* What others than `scene` can read again from their files leaves memory. */
void residency_rest_others(struct residency *r, const struct scene *scene);

bool residency_is_any_busy(const struct residency *r);
uint64_t residency_bytes(const struct residency *r);
/* What is held, and what frames in progress will still take. */
uint64_t residency_claimed(const struct residency *r);
/* Evicts until the budget holds with so many bytes more; `keep`, which may be NULL, stays whatever
 * happens. False: what is left is in use. */
bool residency_make_room(struct residency *r, uint64_t more, const struct scene *keep);
