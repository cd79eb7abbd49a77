/* What is in the store, in order of id. Not thread-safe: under the store's lock. */
#pragma once
#include "server/store/listing.h"

struct store_index {
    struct store_entry *entries;
    uint32_t count;
    size_t capacity;
};

/* Where the id is, or where it would be inserted. */
uint32_t store_index_position(
    const struct store_index *index, const uint8_t id[PEN_ID_BYTES], bool *found);
/* NULL: it is not there. Holds until something is inserted or removed. */
struct store_entry *store_index_find(
    const struct store_index *index, const uint8_t id[PEN_ID_BYTES]);
/* In place of the one with this id, if there is one. */
void store_index_insert(struct store_index *index, const struct store_entry *entry);
void store_index_remove(struct store_index *index, const uint8_t id[PEN_ID_BYTES]);
