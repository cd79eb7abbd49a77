/* Who uploaded what, where tokens are asked for: lines "id owner" of a file beside the store. What
 * several have uploaded belongs to all of them. Thread-safe. */
#pragma once
#include "protocol/error.h"
#include "protocol/limits.h"

struct owners;
/* Errors: PEN_UNAVAILABLE. */
struct owners *owners_open(const char *path, struct pen_error *error);
void owners_close(struct owners *owners); /* NULL is fine */
/* Errors: PEN_UNAVAILABLE, when it could not be written down. */
bool owners_add(
    struct owners *owners, const uint8_t id[PEN_ID_BYTES], uint64_t owner, struct pen_error *error);
bool owners_has(struct owners *owners, const uint8_t id[PEN_ID_BYTES], uint64_t owner);
/* Owner 0: all of them. How many are left. */
uint32_t owners_remove(struct owners *owners, const uint8_t id[PEN_ID_BYTES], uint64_t owner);
/* Adds up, without a lock held, what `bytes` says of each of an owner's. */
uint64_t owners_sum(struct owners *owners, uint64_t owner,
    uint64_t (*bytes)(void *context, const uint8_t id[PEN_ID_BYTES]), void *context);
