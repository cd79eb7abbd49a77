#include "server/store/index.h"
#include "protocol/memory.h"
#include <string.h>

uint32_t store_index_position(
    const struct store_index *index, const uint8_t id[PEN_ID_BYTES], bool *found)
{
    uint32_t low = 0, high = index->count;
    while (low < high) {
        uint32_t middle = (low + high) / 2;
        if (memcmp(index->entries[middle].id, id, PEN_ID_BYTES) < 0)
            low = middle + 1;
        else
            high = middle;
    }
    *found = low < index->count && !memcmp(index->entries[low].id, id, PEN_ID_BYTES);
    return low;
}

struct store_entry *store_index_find(
    const struct store_index *index, const uint8_t id[PEN_ID_BYTES])
{
    bool found;
    uint32_t at = store_index_position(index, id, &found);
    return found ? &index->entries[at] : NULL;
}

void store_index_insert(struct store_index *index, const struct store_entry *entry)
{
    bool found;
    uint32_t at = store_index_position(index, entry->id, &found);
    if (!found) {
        index->entries =
            pen_grow(index->entries, &index->capacity, index->count + 1, sizeof *index->entries);
        memmove(index->entries + at + 1, index->entries + at,
            (index->count++ - at) * sizeof *index->entries);
    }
    index->entries[at] = *entry;
}

void store_index_remove(struct store_index *index, const uint8_t id[PEN_ID_BYTES])
{
    bool found;
    uint32_t at = store_index_position(index, id, &found);
    if (found)
        memmove(index->entries + at, index->entries + at + 1,
            (--index->count - at) * sizeof *index->entries);
}
