/* Sequences of frames that clients have given names: what the light samples of earlier frames have
 * shown, on the screen of the last one, for a method that goes on from there. */
#pragma once
#include "renderer/technique.h"

#define HISTORY_MOST 256 /* sequences that are kept */
#define HISTORY_MOST_PER_OWNER 16

struct history_layer {       /* of one light */
    struct gl_texture mean;  /* RGBA32F: whatever the method sums up, a mean over the samples */
    struct gl_texture state; /* RGBA32F: samples, hardware depth, octahedral geometric normal */
    GLuint framebuffer;      /* of both */
};

/* What a frame has left. */
struct history_set {
    struct history_layer layers[PEN_MAX_LIGHTS];
    uint32_t width, height;
    struct view view;
};

struct history_store;
/* At most so many bytes are kept, and nothing that was not used for idle_ms. */
struct history_store *history_store_create(uint64_t most_bytes, double idle_ms);
void history_store_destroy(struct history_store *store); /* NULL is fine */
uint64_t history_store_bytes(const struct history_store *store);
uint32_t history_store_count(const struct history_store *store); /* of sequences */
/* Drops what nobody used for too long, and what was not used for longest until at most so many bytes
 * are held. */
void history_store_trim(struct history_store *store, uint64_t bytes);

/* A frame in progress goes on with the sequence that the request names. */
bool history_is_busy(const struct history_store *store, const struct pen_request *request);

/* For a frame in progress; NULL when the request names no sequence. */
struct history *history_open(
    struct history_store *store, uint32_t lane, const struct pen_request *request);
/* What the frame has left is kept when `ok`; else the sequence is as it was. NULL is fine. */
void history_close(struct history_store *store, struct history *history, bool ok);

/* The view that chooses a light for a scene without any: that of the sequence's first frame, so that
 * the light stands still when the camera moves on. */
const struct view *history_key_view(
    struct history *history, const struct pen_request *request, const struct view *view);

/* Once for each jittered frame, before the rest. What is kept is dropped when it cannot tell
 * anything of the frame: another scene, size, set of lights, method or parameter. */
void history_begin(struct technique_run *run);
/* This frame leaves something: there is a sequence, and it fits. */
bool history_goes_on(const struct technique_run *run);
/* What the frame before has left of the run's light; NULL: nothing. */
const struct history_set *history_last(const struct technique_run *run);
/* Where this one leaves it. */
const struct history_layer *history_next(const struct technique_run *run);
/* Number of the frame's first light sample in the sequence, of which each jittered frame takes
 * `per_frame`. */
uint32_t history_samples(const struct technique_run *run, uint32_t per_frame);
/* The casters or receivers are not where they were. */
bool history_has_moved(const struct technique_run *run);
uint32_t history_frames(const struct technique_run *run); /* requests before this one */
