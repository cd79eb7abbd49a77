/* What is in the store. Thread-safe. */
#pragma once
#include "protocol/limits.h"
#include "server/store/sums.h"
#include <stddef.h>
#include <stdint.h>

#define STORE_SOURCE "source"
#define STORE_META "meta.json"
#define STORE_THUMBNAIL "thumbnail"

enum store_kind { STORE_SCENES, STORE_IMAGES, STORE_KINDS };

struct store_entry {
    uint8_t id[PEN_ID_BYTES];
    uint64_t source_bytes, blob_bytes, thumbnail_bytes;
    int64_t stored_unix_s;
    bool stale;      /* its blob is of another version, or damaged: to be imported again */
    bool importing;  /* somebody has been asked to */
    bool refused;    /* and its source is no longer accepted */
    bool sourceless; /* as was found by scene_store_scrub */
    struct sums_mark blob_mark, meta_mark;
};

/* What an entry takes of the store's limit; some files beside source and blob are small. */
#define STORE_ENTRY_BYTES 8192
static inline uint64_t store_entry_size(const struct store_entry *entry)
{
    return entry->source_bytes + entry->blob_bytes + entry->thumbnail_bytes + STORE_ENTRY_BYTES;
}

struct scene_store;
bool scene_store_find(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], struct store_entry *entry);
/* At most `limit` entries whose ids come behind `after` (NULL: from the first), in order of id. */
uint32_t scene_store_list(struct scene_store *store, enum store_kind kind, const uint8_t *after,
    struct store_entry *entries, uint32_t limit);
uint32_t scene_store_count(struct scene_store *store, enum store_kind kind);
/* "scene", "image", and what the blob's file is called. */
const char *scene_store_word(enum store_kind kind);
const char *scene_store_blob_name(enum store_kind kind);
