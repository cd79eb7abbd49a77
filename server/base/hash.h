/* SHA-256, streaming. */
#pragma once
#include "protocol/limits.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct hash;
struct hash *hash_create(void); /* aborts on out of memory */
void hash_add(struct hash *hash, const void *data, size_t bytes);
/* Writes the digest and frees the hash. */
void hash_finish(struct hash *hash, uint8_t digest[PEN_ID_BYTES]);
void hash_destroy(struct hash *hash); /* NULL is fine */
/* Of all that the file holds, from its beginning. False when it cannot be read. */
bool hash_file(int fd, uint8_t digest[PEN_ID_BYTES]);
