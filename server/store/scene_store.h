/* What was uploaded, on disk: scenes/<id>/{source,scene.pscene,meta.json} and
 * images/<id>/{source,image.pscene,meta.json}, where <id> is the SHA-256 of the source. A folder is
 * complete or not there: it is filled under tmp/, synced, and renamed. Thread-safe. */
#pragma once
#include "protocol/error.h"
#include "protocol/limits.h"
#include <stddef.h>
#include <stdint.h>

enum store_kind { STORE_SCENES, STORE_IMAGES, STORE_KINDS };

struct store_entry {
    uint8_t id[PEN_ID_BYTES];
    uint64_t source_bytes, blob_bytes;
    int64_t stored_unix_s;
    bool stale; /* its blob is of another version, or damaged: to be imported again */
};

/* A folder under tmp/ that is being filled. */
struct store_staging {
    char name[32];
    int folder; /* O_DIRECTORY; -1: none */
};

struct scene_store;
/* Creates what is missing, removes what a crash left under tmp/, and lists what is there. Errors:
 * PEN_UNAVAILABLE (no such folder, no permission, another daemon uses it). */
struct scene_store *scene_store_open(const char *path, struct pen_error *error);
void scene_store_close(struct scene_store *store);

bool scene_store_find(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], struct store_entry *entry);
/* At most `limit` entries whose ids come behind `after` (NULL: from the first), in order of id. */
uint32_t scene_store_list(struct scene_store *store, enum store_kind kind, const uint8_t *after,
    struct store_entry *entries, uint32_t limit);
uint32_t scene_store_count(struct scene_store *store, enum store_kind kind);
/* Read-only descriptors, the caller's. -1 and PEN_NOT_FOUND when it is not there, PEN_UNAVAILABLE
 * while its blob is stale. */
int scene_store_open_blob(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], struct pen_error *error);
int scene_store_open_source(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], struct pen_error *error);
int scene_store_open_meta(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], struct pen_error *error);
/* The entry's folder, for what is derived from it: goes with the entry. -1: not there. */
int scene_store_open_folder(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], struct pen_error *error);
bool scene_store_remove(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], struct pen_error *error);

/* Files in a staging folder are opened relative to staging->folder, under these names. */
#define STORE_SOURCE "source"
#define STORE_META "meta.json"
const char *scene_store_blob_name(enum store_kind kind);
bool scene_store_stage(
    struct scene_store *store, struct store_staging *staging, struct pen_error *error);
/* Syncs the files and the folder and gives it its name. *added is false when the id is there
 * already; the staging folder is gone either way, also on failure. Errors: PEN_UNAVAILABLE. */
bool scene_store_commit(struct scene_store *store, enum store_kind kind,
    struct store_staging *staging, const uint8_t id[PEN_ID_BYTES], bool *added,
    struct pen_error *error);
/* Moves the staging folder's blob over a stale one. The staging folder is gone afterwards. */
bool scene_store_refresh(struct scene_store *store, enum store_kind kind,
    struct store_staging *staging, const uint8_t id[PEN_ID_BYTES], struct pen_error *error);
void scene_store_discard(struct scene_store *store, struct store_staging *staging);
