/* Shadow inputs (depth maps and what is derived from them) depend on scene and light, not on the
 * camera: they are kept between requests under the renderer's memory budget. */
#pragma once
#include "renderer/technique.h"

#define SHADOW_INPUT_TEXTURES 6
#define SHADOW_CACHE_LANES 32 /* as bits are counted */

/* What an input is. A kind of a new method is a string literal of its own: two inputs are the same
 * when kind, scene and its pose, light face, size and extra agree. */
struct shadow_key {
    const char *kind;  /* "depth", "minmax", ... */
    uint32_t size;     /* map texels per side */
    bool of_centre;    /* nothing in it depends on how large the light is */
    uint32_t extra[8]; /* whatever else the content depends on; bit patterns of floats too */
};

struct shadow_input {
    struct gl_texture textures[SHADOW_INPUT_TEXTURES]; /* as the kind defines */
    float values[64]; /* numbers that belong to it (windows of off-axis maps, ...) */
};

/* make_room is called before an input's textures take so many bytes. */
struct shadow_cache *shadow_cache_create(
    bool (*make_room)(void *owner, uint64_t bytes), void *owner);
void shadow_cache_destroy(struct shadow_cache *cache);

typedef bool (*shadow_build)(struct technique_run *run, const struct shadow_key *key,
    struct shadow_input *input, struct pen_error *error);

/* The input, built by `build` when it is not there. Valid until the lane's
 * next shadow_cache_release. */
const struct shadow_input *shadow_cache_get(struct technique_run *run, const struct shadow_key *key,
    shadow_build build, struct pen_error *error);

/* For inputs that are filled bit by bit: something was drawn into one in this frame. */
void shadow_cache_mark_built(const struct technique_ctx *ctx);

uint64_t shadow_cache_bytes(const struct shadow_cache *cache);
/* Of those that only other lanes have got and not released. */
uint64_t shadow_cache_bytes_beside(const struct shadow_cache *cache, uint32_t lane);
/* Drops the least recently used inputs that no frame in progress uses until `bytes` or less are
 * held. */
void shadow_cache_trim(struct shadow_cache *cache, uint64_t bytes);
void shadow_cache_drop_scene(struct shadow_cache *cache, const struct scene *scene);
/* What a lane gets is not trimmed until it releases it: at the end of a frame, and before the next
 * face of a light. The first of these releases too, and sets the lane's counter to 0. */
void shadow_cache_begin_frame(const struct technique_ctx *ctx);
void shadow_cache_release(const struct technique_ctx *ctx);
/* 1 when every input of the lane's frame was already there. */
bool shadow_cache_all_reused(const struct technique_ctx *ctx);
