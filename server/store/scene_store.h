/* What was uploaded, on disk: scenes/<id>/{source,scene.pscene,meta.json,sums} and
 * images/<id>/{source,image.pscene,meta.json,sums}, where <id> is the SHA-256 of the source. A folder
 * is complete or not there: it is filled under tmp/, synced, and renamed. What is opened is checked
 * against its sum first: a damaged blob is made again from its source, a description from its blob,
 * and what has lost both goes to damaged/, to be uploaded again. Thread-safe. */
#pragma once
#include "protocol/error.h"
#include "server/store/listing.h"
#include "server/store/quota.h"

/* A folder under tmp/ that is being filled. */
struct store_staging {
    char name[32];
    int folder;       /* O_DIRECTORY; -1: none */
    uint64_t claimed; /* bytes of the quota */
};

/* Creates what is missing, removes what a crash left under tmp/, and lists what is there. `limit`: of the
 * quota; what is more than that already stays. Errors:
 * PEN_UNAVAILABLE (no such folder, no permission, another daemon uses it). */
struct scene_store *scene_store_open(const char *path, uint64_t limit, struct pen_error *error);
void scene_store_close(struct scene_store *store);
struct store_quota *scene_store_quota(struct scene_store *store);

/* Calls `import` for each entry that is stale, now and whenever one is found to be, from any thread
 * and without a lock; to be answered by scene_store_refresh or scene_store_not_refreshed. */
typedef void store_import(void *context, enum store_kind kind, const uint8_t id[PEN_ID_BYTES]);
void scene_store_on_stale(struct scene_store *store, store_import *import, void *context);

/* True when its blob may be opened. Errors: PEN_NOT_FOUND; PEN_UNAVAILABLE while it is imported
 * again, which is asked for when nobody does it; PEN_INVALID when that was refused. */
bool scene_store_is_ready(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], struct pen_error *error);
/* Read-only descriptors, the caller's, of files that are what was stored; of the source only its id
 * tells that. -1 and what scene_store_is_ready says, PEN_UNAVAILABLE for a damaged description. */
int scene_store_open_blob(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], struct pen_error *error);
int scene_store_open_source(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], struct pen_error *error);
int scene_store_open_meta(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], struct pen_error *error);
/* The entry's folder, for what is derived from it: goes with the entry. -1: not there. */
int scene_store_open_folder(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], struct pen_error *error);
/* The thumbnail in a scene's folder has so many bytes now, of which `claimed` were claimed. */
void scene_store_set_thumbnail(
    struct scene_store *store, const uint8_t id[PEN_ID_BYTES], uint64_t bytes, uint64_t claimed);
bool scene_store_remove(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], struct pen_error *error);

/* Files in a staging folder are opened relative to staging->folder, and claimed before they are written. */
bool scene_store_stage(
    struct scene_store *store, struct store_staging *staging, struct pen_error *error);
/* As store_quota_claim; given back when the folder is discarded, or by the size of the entry. */
bool scene_store_claim(struct scene_store *store, struct store_staging *staging, uint64_t bytes,
    struct pen_error *error);
/* Of what was claimed for files that are gone again. */
void scene_store_give_back(
    struct scene_store *store, struct store_staging *staging, uint64_t bytes);
/* Adds up and syncs the files and gives the folder its name. *added is false when the id is there
 * already, and sound; what is not is replaced. The staging folder is gone either way, also on
 * failure. Errors: PEN_UNAVAILABLE, PEN_FULL. */
bool scene_store_commit(struct scene_store *store, enum store_kind kind,
    struct store_staging *staging, const uint8_t id[PEN_ID_BYTES], bool *added,
    struct pen_error *error);
/* True when blob, description and source are what was stored. Reads all of them. */
bool scene_store_is_sound(
    struct scene_store *store, enum store_kind kind, const uint8_t id[PEN_ID_BYTES]);
/* Reads blob and source whatever is known of them, and does about a damaged blob what opening does.
 * A damaged source is told of: the entry is drawn as long as its blob is whole. */
void scene_store_scrub(
    struct scene_store *store, enum store_kind kind, const uint8_t id[PEN_ID_BYTES]);
/* Files that were found damaged since it was opened. */
uint64_t scene_store_faults(struct scene_store *store);
/* Takes an entry out that nothing can be made of any more, and keeps its files in damaged/. */
void scene_store_lose(
    struct scene_store *store, enum store_kind kind, const uint8_t id[PEN_ID_BYTES]);
/* A description made again. */
bool scene_store_mend_meta(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], const char *text);
/* Moves the staging folder's blob over a stale one. The staging folder is gone afterwards. */
bool scene_store_refresh(struct scene_store *store, enum store_kind kind,
    struct store_staging *staging, const uint8_t id[PEN_ID_BYTES], struct pen_error *error);
/* A stale entry could not be imported again: now, or, for_good, since its source is refused. */
void scene_store_not_refreshed(
    struct scene_store *store, enum store_kind kind, const uint8_t id[PEN_ID_BYTES], bool for_good);
void scene_store_discard(struct scene_store *store, struct store_staging *staging);
