#include "server/store/scene_store.h"
#include "protocol/memory.h"
#include "renderer/blob/pscene.h"
#include "server/base/file.h"
#include "server/base/log.h"
#include "server/store/shelf.h"
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

static void scan(struct scene_store *store, enum store_kind kind)
{
    int copy = openat(store->kinds[kind], ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *dir = copy >= 0 ? fdopendir(copy) : NULL;
    struct dirent *item;
    while (dir && (item = readdir(dir))) {
        struct store_entry entry;
        if (*item->d_name == '.')
            continue;
        if (scene_store_inspect(store, kind, item->d_name, &entry))
            scene_store_enter(store, kind, &entry, 0);
        else if (pen_id_from_hex(item->d_name, entry.id))
            scene_store_put_aside(store, kind, item->d_name);
        else
            log_event(LOG_ERROR, "%s/%.80s in the store is not of this program and is left alone",
                scene_store_folders[kind], item->d_name);
    }
    if (dir)
        closedir(dir);
}

static void empty_tmp(struct scene_store *store)
{
    int copy = openat(store->tmp, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *dir = copy >= 0 ? fdopendir(copy) : NULL;
    struct dirent *item;
    while (dir && (item = readdir(dir)))
        if (strcmp(item->d_name, ".") && strcmp(item->d_name, ".."))
            file_remove_all(store->tmp, item->d_name);
    if (dir)
        closedir(dir);
}

static int open_folder(int parent, const char *name)
{
    if (mkdirat(parent, name, 0700) && errno != EEXIST)
        return -1;
    return openat(parent, name, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
}

/* Folder `name` of the store, one that may be written to. */
static bool open_part(struct scene_store *store, const char *path, const char *name, int *folder,
    struct pen_error *error)
{
    *folder = open_folder(store->root, name);
    if (*folder >= 0 && !faccessat(*folder, ".", R_OK | W_OK | X_OK, AT_EACCESS))
        return true;
    return pen_fail(error, PEN_UNAVAILABLE, "",
        "The store %.200s cannot be used: its folder %s: %s.", path, name, strerror(errno));
}

static bool open_all(struct scene_store *store, const char *path, struct pen_error *error)
{
    store->root = open_folder(AT_FDCWD, path);
    if (store->root < 0)
        return pen_fail(error, PEN_UNAVAILABLE, "", "The store %.200s cannot be used: %s.", path,
            strerror(errno));
    store->lock_file = openat(store->root, "lock", O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (store->lock_file < 0)
        return pen_fail(error, PEN_UNAVAILABLE, "",
            "The store %.200s cannot be used: its file lock: %s.", path, strerror(errno));
    if (flock(store->lock_file, LOCK_EX | LOCK_NB))
        return pen_fail(error, PEN_UNAVAILABLE, "", "Another daemon uses the store %.200s.", path);
    bool ok = open_part(store, path, "tmp", &store->tmp, error) &&
              open_part(store, path, "damaged", &store->damaged, error);
    for (int k = 0; ok && k < STORE_KINDS; k++)
        ok = open_part(store, path, scene_store_folders[k], &store->kinds[k], error);
    return ok;
}

struct scene_store *scene_store_open(const char *path, uint64_t limit, struct pen_error *error)
{
    struct scene_store *store = pen_alloc_zero(1, sizeof *store);
    pthread_mutex_init(&store->lock, NULL);
    store->quota = store_quota_create(limit);
    store->tmp = store->damaged = store->lock_file = -1;
    store->kinds[STORE_SCENES] = store->kinds[STORE_IMAGES] = -1;
    if (!open_all(store, path, error)) {
        scene_store_close(store);
        return NULL;
    }
    empty_tmp(store);
    for (int k = 0; k < STORE_KINDS; k++)
        scan(store, k);
    return store;
}

void scene_store_close(struct scene_store *store)
{
    if (!store)
        return;
    const int fds[] = {store->root, store->tmp, store->damaged, store->lock_file, store->kinds[0],
        store->kinds[1]};
    for (size_t i = 0; i < sizeof fds / sizeof *fds; i++)
        if (fds[i] >= 0)
            close(fds[i]);
    for (int k = 0; k < STORE_KINDS; k++)
        free(store->lists[k].entries);
    store_quota_destroy(store->quota);
    pthread_mutex_destroy(&store->lock);
    free(store);
}

bool scene_store_remove(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], struct pen_error *error)
{
    char hex[PEN_ID_HEX + 1], name[32];
    pen_id_to_hex(id, hex);
    scene_store_new_name(store, name);
    if (renameat(store->kinds[kind], hex, store->tmp, name)) {
        if (errno == ENOENT)
            return pen_fail(
                error, PEN_NOT_FOUND, "", "There is no such %s.", scene_store_word(kind));
        return pen_fail(error, PEN_UNAVAILABLE, "", "The store could not be written.");
    }
    scene_store_leave(store, kind, id);
    fsync(store->kinds[kind]);
    file_remove_all(store->tmp, name);
    return true;
}

bool scene_store_stage(
    struct scene_store *store, struct store_staging *staging, struct pen_error *error)
{
    scene_store_new_name(store, staging->name);
    staging->claimed = 0;
    staging->folder = open_folder(store->tmp, staging->name);
    return staging->folder >= 0 || store_write_failed(errno, error);
}

void scene_store_discard(struct scene_store *store, struct store_staging *staging)
{
    if (staging->folder < 0)
        return;
    close(staging->folder);
    staging->folder = -1;
    file_remove_all(store->tmp, staging->name);
    store_quota_settle(store->quota, staging->claimed, 0);
    staging->claimed = 0;
}

void scene_store_give_back(struct scene_store *store, struct store_staging *staging, uint64_t bytes)
{
    store_quota_settle(store->quota, bytes, 0);
    staging->claimed -= bytes;
}

bool scene_store_claim(struct scene_store *store, struct store_staging *staging, uint64_t bytes,
    struct pen_error *error)
{
    bool ok = store_quota_claim(store->quota, bytes, error);
    staging->claimed += ok ? bytes : 0;
    return ok;
}

struct store_quota *scene_store_quota(struct scene_store *store)
{
    return store->quota;
}

static bool sync_file(int folder, const char *name)
{
    int fd = openat(folder, name, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    bool ok = fd >= 0 && !fsync(fd);
    if (fd >= 0)
        close(fd);
    return ok;
}

/* Gives the staging folder its name, in place of what has it unless that is sound. */
static bool take_name(struct scene_store *store, enum store_kind kind,
    const struct store_staging *staging, const char *hex, const uint8_t id[PEN_ID_BYTES],
    bool *added)
{
    char aside[32];
    *added = !renameat(store->tmp, staging->name, store->kinds[kind], hex);
    if (*added)
        return true;
    if (errno != EEXIST && errno != ENOTEMPTY && errno != ENOTDIR)
        return false;
    if (scene_store_is_sound(store, kind, id))
        return true;
    scene_store_new_name(store, aside);
    if (renameat(store->kinds[kind], hex, store->tmp, aside))
        return false;
    *added = !renameat(store->tmp, staging->name, store->kinds[kind], hex);
    file_remove_all(store->tmp, aside);
    return *added;
}

bool scene_store_commit(struct scene_store *store, enum store_kind kind,
    struct store_staging *staging, const uint8_t id[PEN_ID_BYTES], bool *added,
    struct pen_error *error)
{
    const char *const summed[] = {scene_store_blob_name(kind), STORE_META};
    char hex[PEN_ID_HEX + 1];
    struct store_entry entry;
    pen_id_to_hex(id, hex);
    *added = false;
    bool ok = sync_file(staging->folder, STORE_SOURCE) &&
              sync_file(staging->folder, scene_store_blob_name(kind)) &&
              sync_file(staging->folder, STORE_META) && sums_write(staging->folder, summed, 2) &&
              !fsync(staging->folder) && take_name(store, kind, staging, hex, id, added);
    int failed = errno;
    if (!*added) {
        scene_store_discard(store, staging);
        return ok || store_write_failed(failed, error);
    }
    close(staging->folder);
    staging->folder = -1;
    fsync(store->kinds[kind]);
    if (scene_store_inspect(store, kind, hex, &entry))
        scene_store_enter(store, kind, &entry, staging->claimed);
    else
        store_quota_settle(store->quota, staging->claimed, 0);
    staging->claimed = 0;
    return true;
}

bool scene_store_refresh(struct scene_store *store, enum store_kind kind,
    struct store_staging *staging, const uint8_t id[PEN_ID_BYTES], struct pen_error *error)
{
    const char *const summed[] = {scene_store_blob_name(kind), STORE_META};
    char hex[PEN_ID_HEX + 1];
    struct store_entry entry;
    pen_id_to_hex(id, hex);
    int folder = scene_store_folder(store, kind, hex);
    bool ok = folder >= 0 && sync_file(staging->folder, scene_store_blob_name(kind)) &&
              sums_write(staging->folder, summed, 2) &&
              file_replace(staging->folder, scene_store_blob_name(kind), folder,
                  scene_store_blob_name(kind)) &&
              file_replace(staging->folder, STORE_META, folder, STORE_META) &&
              file_replace(staging->folder, STORE_SUMS, folder, STORE_SUMS) && !fsync(folder);
    int failed = errno;
    if (folder >= 0) {
        unlinkat(folder, STORE_THUMBNAIL, 0); /* of what the scene was */
        close(folder);
    }
    scene_store_discard(store, staging);
    if (!ok || !scene_store_inspect(store, kind, hex, &entry))
        return store_write_failed(failed, error);
    scene_store_renew(store, kind, &entry);
    return true;
}
