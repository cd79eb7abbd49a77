/* How much the store may hold: what is stored, what is on its way in, and what is kept beside it.
 * Thread-safe. */
#pragma once
#include "protocol/error.h"

struct store_quota;
struct store_quota *store_quota_create(uint64_t limit); /* bytes; 0: as much as the disk holds */
void store_quota_destroy(struct store_quota *quota);

/* Bytes that are about to be written. Errors: PEN_FULL, with the figures. */
bool store_quota_claim(struct store_quota *quota, uint64_t bytes, struct pen_error *error);
/* As a claim that nothing is done about, not even to free anything. */
bool store_quota_fits(struct store_quota *quota, uint64_t bytes, struct pen_error *error);
/* What was claimed, or found there, is other than it was: `before` bytes are now `after`. */
void store_quota_settle(struct store_quota *quota, uint64_t before, uint64_t after);
/* Of what is used, what `reclaim` could free: `before` bytes are now `after`. */
void store_quota_spare(struct store_quota *quota, uint64_t before, uint64_t after);
/* Bytes that may still be claimed, with what can be freed for that; UINT64_MAX: no limit. */
uint64_t store_quota_left(struct store_quota *quota);
uint64_t store_quota_used(struct store_quota *quota);

/* Called, without a lock and from any thread, before a claim is refused: frees what can be made again, least
 * recently used first, about `bytes` of it, and settles that. */
typedef void store_reclaim(void *context, uint64_t bytes);
void store_quota_on_need(struct store_quota *quota, store_reclaim *reclaim, void *context);

/* The last write failed with this errno: PEN_FULL or PEN_UNAVAILABLE. Returns false. */
bool store_write_failed(int code, struct pen_error *error);
