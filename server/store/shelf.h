/* The folders of the store and the list of what is in them: what the rest of the store is made of. */
#pragma once
#include "server/store/index.h"
#include "server/store/quota.h"
#include <pthread.h>

struct scene_store {
    int root, tmp, damaged, lock_file, kinds[STORE_KINDS]; /* folders; constant */
    struct store_quota *quota;
    pthread_mutex_t lock; /* guards what follows */
    struct store_index lists[STORE_KINDS];
    uint64_t next_name, faults;
    void (*import)(void *context, enum store_kind kind, const uint8_t id[PEN_ID_BYTES]);
    void *import_context;
};

extern const char *const scene_store_folders[STORE_KINDS];
/* A name that nothing under tmp/ has. */
void scene_store_new_name(struct scene_store *store, char name[32]);
/* The entry's folder under kinds[kind]; -1: there is none. */
int scene_store_folder(struct scene_store *store, enum store_kind kind, const char *name);
/* Looks at one folder; false when nothing can be made of it. */
bool scene_store_inspect(
    struct scene_store *store, enum store_kind kind, const char *name, struct store_entry *entry);
/* Lists an entry, in place of the one with its id; `claimed` bytes of the quota were for it. */
void scene_store_enter(struct scene_store *store, enum store_kind kind,
    const struct store_entry *entry, uint64_t claimed);
/* In place of the one with its id, unless that was deleted meanwhile. */
void scene_store_renew(
    struct scene_store *store, enum store_kind kind, const struct store_entry *entry);
/* Takes an entry off the list; nothing when it is not there. */
void scene_store_leave(
    struct scene_store *store, enum store_kind kind, const uint8_t id[PEN_ID_BYTES]);
/* Moves what has this name out of the way, into damaged/. */
void scene_store_put_aside(struct scene_store *store, enum store_kind kind, const char *name);
