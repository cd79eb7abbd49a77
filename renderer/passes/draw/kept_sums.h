/* What the light samples of a render have added up to, for the next one that asks for more of the
 * same: it is gone on with, not begun again. */
#pragma once
#include "renderer/technique.h"

#define KEPT_SUMS_MOST 16 /* requests whose sums are kept */

/* Of one light, or of one of its faces, in one jittered frame. */
struct kept_sum {
    uint32_t samples; /* in it; 0 while it is not complete, too */
    struct gl_target sum;
    /* What else the method sums up, its own; `bytes` count until `destroy`. */
    void *own;
    void (*destroy)(void *own);
    uint64_t bytes;
};

struct kept_sums; /* of one request */
struct kept_sums_store;
/* At most so many bytes are kept. */
struct kept_sums_store *kept_sums_store_create(uint64_t most_bytes);
void kept_sums_store_destroy(struct kept_sums_store *store); /* NULL is fine */
uint64_t kept_sums_store_bytes(const struct kept_sums_store *store);
/* Drops what was not used for longest until at most so many bytes are held; not what renders in
 * progress use. */
void kept_sums_store_trim(struct kept_sums_store *store, uint64_t bytes);
/* The scene, or the image of a light, goes. */
void kept_sums_store_drop(struct kept_sums_store *store, const uint8_t id[PEN_ID_BYTES]);

/* For a render in progress: the sums of the same request but for the number of samples and the file
 * format, or new ones; `room`: bytes by which they may grow. NULL when another one has them. */
struct kept_sums *kept_sums_open(struct kept_sums_store *store, const struct pen_request *request,
    const struct pen_technique_info *info, uint64_t room);
void kept_sums_close(struct kept_sums_store *store, struct kept_sums *sums); /* NULL is fine */
/* Samples that the render took over, summed over faces and jittered frames. */
uint64_t kept_sums_taken(const struct kept_sums *sums); /* NULL: 0 */

/* What there is of the run's face, at most `most` samples, and where more go; NULL: nothing is kept,
 * because nobody wants it, there are more samples in it, or there is no room for `bytes`. `faces`:
 * that it stands for. */
struct kept_sum *kept_sum_open(
    struct technique_run *run, uint32_t most, uint32_t faces, uint64_t bytes);
/* Its target, RGBA32F and the size of the picture; cleared while there are no samples in it. */
#define KEPT_SUM_BYTES 16 /* per pixel of it */
const struct gl_target *kept_sum_target(struct technique_run *run, struct kept_sum *kept);
