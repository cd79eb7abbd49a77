#include "server/store/scene_store.h"
#include "protocol/memory.h"
#include "renderer/blob/pscene.h"
#include "server/base/log.h"
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

static const char *const kind_folders[STORE_KINDS] = {"scenes", "images"};
static const char *const kind_blobs[STORE_KINDS] = {"scene.pscene", "image.pscene"};

struct list {
    struct store_entry *entries; /* in order of id */
    uint32_t count;
    size_t capacity;
};

struct scene_store {
    int root, tmp, lock_file, kinds[STORE_KINDS]; /* folders; constant */
    pthread_mutex_t lock;                         /* guards lists and next_name */
    struct list lists[STORE_KINDS];
    uint64_t next_name;
};

const char *scene_store_blob_name(enum store_kind kind)
{
    return kind_blobs[kind];
}

/* ---- the index, under the lock ---- */

/* Where the id is, or where it would be inserted. */
static uint32_t position(const struct list *list, const uint8_t id[PEN_ID_BYTES], bool *found)
{
    uint32_t low = 0, high = list->count;
    while (low < high) {
        uint32_t middle = (low + high) / 2;
        if (memcmp(list->entries[middle].id, id, PEN_ID_BYTES) < 0)
            low = middle + 1;
        else
            high = middle;
    }
    *found = low < list->count && !memcmp(list->entries[low].id, id, PEN_ID_BYTES);
    return low;
}

static void insert(struct list *list, const struct store_entry *entry)
{
    bool found;
    uint32_t at = position(list, entry->id, &found);
    if (!found) {
        list->entries =
            pen_grow(list->entries, &list->capacity, list->count + 1, sizeof *list->entries);
        memmove(list->entries + at + 1, list->entries + at,
            (list->count++ - at) * sizeof *list->entries);
    }
    list->entries[at] = *entry;
}

/* ---- files ---- */

static void remove_folder(int parent, const char *name)
{
    int folder = openat(parent, name, O_RDONLY | O_DIRECTORY | O_CLOEXEC | O_NOFOLLOW);
    DIR *dir = folder >= 0 ? fdopendir(folder) : NULL;
    if (dir) {
        struct dirent *item;
        while ((item = readdir(dir)))
            if (strcmp(item->d_name, ".") && strcmp(item->d_name, ".."))
                unlinkat(folder, item->d_name, 0);
        closedir(dir);
    } else if (folder >= 0) {
        close(folder);
    }
    if (unlinkat(parent, name, AT_REMOVEDIR) && errno == ENOTDIR)
        unlinkat(parent, name, 0);
}

static bool is_good_blob(
    int folder, enum store_kind kind, const uint8_t id[PEN_ID_BYTES], uint64_t *bytes)
{
    struct psc_header header;
    struct stat status;
    int fd = openat(folder, kind_blobs[kind], O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    bool good = fd >= 0 && !fstat(fd, &status) &&
                pread(fd, &header, sizeof header, 0) == (ssize_t)sizeof header &&
                !memcmp(header.magic, PSC_MAGIC, sizeof header.magic) &&
                header.version == PSC_VERSION && header.header_bytes == sizeof header &&
                header.file_bytes == (uint64_t)status.st_size &&
                !memcmp(header.source, id, PEN_ID_BYTES);
    *bytes = good ? header.file_bytes : 0;
    if (fd >= 0)
        close(fd);
    return good;
}

/* Looks at one folder of the store; false when it is not a stored thing. */
static bool inspect(
    struct scene_store *store, enum store_kind kind, const char *name, struct store_entry *entry)
{
    memset(entry, 0, sizeof *entry);
    if (!pen_id_from_hex(name, entry->id))
        return false;
    struct stat status;
    int folder = openat(store->kinds[kind], name, O_RDONLY | O_DIRECTORY | O_CLOEXEC | O_NOFOLLOW);
    if (folder < 0)
        return false;
    bool has_source =
        !fstatat(folder, STORE_SOURCE, &status, AT_SYMLINK_NOFOLLOW) && S_ISREG(status.st_mode);
    entry->source_bytes = has_source ? (uint64_t)status.st_size : 0;
    entry->stored_unix_s = has_source ? status.st_mtim.tv_sec : 0;
    entry->stale = !is_good_blob(folder, kind, entry->id, &entry->blob_bytes);
    close(folder);
    return has_source;
}

static void scan(struct scene_store *store, enum store_kind kind)
{
    int copy = openat(store->kinds[kind], ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *dir = copy >= 0 ? fdopendir(copy) : NULL;
    struct dirent *item;
    while (dir && (item = readdir(dir))) {
        struct store_entry entry;
        if (*item->d_name == '.')
            continue;
        if (inspect(store, kind, item->d_name, &entry))
            insert(&store->lists[kind], &entry);
        else
            log_event(LOG_ERROR, "%s/%.80s in the store is not complete and is left alone",
                kind_folders[kind], item->d_name);
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
            remove_folder(store->tmp, item->d_name);
    if (dir)
        closedir(dir);
}

static int open_folder(int parent, const char *name)
{
    if (mkdirat(parent, name, 0700) && errno != EEXIST)
        return -1;
    return openat(parent, name, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
}

struct scene_store *scene_store_open(const char *path, struct pen_error *error)
{
    struct scene_store *store = pen_alloc_zero(1, sizeof *store);
    pthread_mutex_init(&store->lock, NULL);
    store->tmp = store->lock_file = store->kinds[STORE_SCENES] = store->kinds[STORE_IMAGES] = -1;
    store->root = open_folder(AT_FDCWD, path);
    if (store->root >= 0) {
        store->lock_file = openat(store->root, "lock", O_RDWR | O_CREAT | O_CLOEXEC, 0600);
        store->tmp = open_folder(store->root, "tmp");
        for (int k = 0; k < STORE_KINDS; k++)
            store->kinds[k] = open_folder(store->root, kind_folders[k]);
    }
    if (store->root < 0 || store->tmp < 0 || store->lock_file < 0 ||
        store->kinds[STORE_SCENES] < 0 || store->kinds[STORE_IMAGES] < 0) {
        pen_fail(error, PEN_UNAVAILABLE, "", "The store %.200s cannot be opened: %s.", path,
            strerror(errno));
        goto fail;
    }
    if (flock(store->lock_file, LOCK_EX | LOCK_NB)) {
        pen_fail(error, PEN_UNAVAILABLE, "", "Another daemon uses the store %.200s.", path);
        goto fail;
    }
    empty_tmp(store);
    for (int k = 0; k < STORE_KINDS; k++)
        scan(store, k);
    return store;
fail:
    scene_store_close(store);
    return NULL;
}

void scene_store_close(struct scene_store *store)
{
    if (!store)
        return;
    const int fds[] = {store->root, store->tmp, store->lock_file, store->kinds[0], store->kinds[1]};
    for (size_t i = 0; i < sizeof fds / sizeof *fds; i++)
        if (fds[i] >= 0)
            close(fds[i]);
    for (int k = 0; k < STORE_KINDS; k++)
        free(store->lists[k].entries);
    pthread_mutex_destroy(&store->lock);
    free(store);
}

bool scene_store_find(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], struct store_entry *entry)
{
    bool found;
    pthread_mutex_lock(&store->lock);
    uint32_t at = position(&store->lists[kind], id, &found);
    if (found && entry)
        *entry = store->lists[kind].entries[at];
    pthread_mutex_unlock(&store->lock);
    return found;
}

uint32_t scene_store_list(struct scene_store *store, enum store_kind kind, const uint8_t *after,
    struct store_entry *entries, uint32_t limit)
{
    bool found = false;
    pthread_mutex_lock(&store->lock);
    const struct list *list = &store->lists[kind];
    uint32_t at = after ? position(list, after, &found) : 0;
    at += found;
    uint32_t count = list->count - at < limit ? list->count - at : limit;
    if (count)
        memcpy(entries, list->entries + at, count * sizeof *entries);
    pthread_mutex_unlock(&store->lock);
    return count;
}

uint32_t scene_store_count(struct scene_store *store, enum store_kind kind)
{
    pthread_mutex_lock(&store->lock);
    uint32_t count = store->lists[kind].count;
    pthread_mutex_unlock(&store->lock);
    return count;
}

static int open_file(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], const char *name, struct pen_error *error)
{
    char path[PEN_ID_HEX + 32];
    pen_id_to_hex(id, path);
    snprintf(path + PEN_ID_HEX, sizeof path - PEN_ID_HEX, "/%s", name);
    int fd = openat(store->kinds[kind], path, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    if (fd < 0 && errno == ENOENT)
        pen_fail(error, PEN_NOT_FOUND, "", "There is no such %s.",
            kind == STORE_SCENES ? "scene" : "image");
    else if (fd < 0)
        pen_fail(error, PEN_UNAVAILABLE, "", "The store could not be read.");
    return fd;
}

int scene_store_open_blob(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], struct pen_error *error)
{
    struct store_entry entry;
    if (scene_store_find(store, kind, id, &entry) && entry.stale) {
        pen_fail(error, PEN_UNAVAILABLE, "", "The %s is being imported again.",
            kind == STORE_SCENES ? "scene" : "image");
        return -1;
    }
    return open_file(store, kind, id, kind_blobs[kind], error);
}

int scene_store_open_source(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], struct pen_error *error)
{
    return open_file(store, kind, id, STORE_SOURCE, error);
}

int scene_store_open_meta(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], struct pen_error *error)
{
    return open_file(store, kind, id, STORE_META, error);
}

int scene_store_open_folder(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], struct pen_error *error)
{
    return open_file(store, kind, id, ".", error);
}

static void new_name(struct scene_store *store, char name[32])
{
    pthread_mutex_lock(&store->lock);
    uint64_t number = ++store->next_name;
    pthread_mutex_unlock(&store->lock);
    snprintf(name, 32, "%llu", (unsigned long long)number);
}

bool scene_store_remove(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], struct pen_error *error)
{
    char hex[PEN_ID_HEX + 1], name[32];
    bool found;
    pen_id_to_hex(id, hex);
    new_name(store, name);
    if (renameat(store->kinds[kind], hex, store->tmp, name)) {
        if (errno == ENOENT)
            return pen_fail(error, PEN_NOT_FOUND, "", "There is no such %s.",
                kind == STORE_SCENES ? "scene" : "image");
        return pen_fail(error, PEN_UNAVAILABLE, "", "The store could not be written.");
    }
    pthread_mutex_lock(&store->lock);
    struct list *list = &store->lists[kind];
    uint32_t at = position(list, id, &found);
    if (found)
        memmove(list->entries + at, list->entries + at + 1,
            (--list->count - at) * sizeof *list->entries);
    pthread_mutex_unlock(&store->lock);
    fsync(store->kinds[kind]);
    remove_folder(store->tmp, name);
    return true;
}

bool scene_store_stage(
    struct scene_store *store, struct store_staging *staging, struct pen_error *error)
{
    new_name(store, staging->name);
    staging->folder = open_folder(store->tmp, staging->name);
    if (staging->folder < 0)
        return pen_fail(error, PEN_UNAVAILABLE, "", "The store could not be written.");
    return true;
}

void scene_store_discard(struct scene_store *store, struct store_staging *staging)
{
    if (staging->folder < 0)
        return;
    close(staging->folder);
    staging->folder = -1;
    remove_folder(store->tmp, staging->name);
}

static bool sync_file(int folder, const char *name)
{
    int fd = openat(folder, name, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    bool ok = fd >= 0 && !fsync(fd);
    if (fd >= 0)
        close(fd);
    return ok;
}

bool scene_store_commit(struct scene_store *store, enum store_kind kind,
    struct store_staging *staging, const uint8_t id[PEN_ID_BYTES], bool *added,
    struct pen_error *error)
{
    char hex[PEN_ID_HEX + 1];
    struct store_entry entry;
    pen_id_to_hex(id, hex);
    *added = false;
    bool ok = sync_file(staging->folder, STORE_SOURCE) &&
              sync_file(staging->folder, kind_blobs[kind]) &&
              sync_file(staging->folder, STORE_META) && !fsync(staging->folder);
    bool renamed = ok && !renameat(store->tmp, staging->name, store->kinds[kind], hex);
    bool exists = ok && !renamed && (errno == EEXIST || errno == ENOTEMPTY);
    if (!renamed) {
        scene_store_discard(store, staging);
        return exists || pen_fail(error, PEN_UNAVAILABLE, "", "The store could not be written.");
    }
    close(staging->folder);
    staging->folder = -1;
    fsync(store->kinds[kind]);
    *added = true;
    if (inspect(store, kind, hex, &entry)) {
        pthread_mutex_lock(&store->lock);
        insert(&store->lists[kind], &entry);
        pthread_mutex_unlock(&store->lock);
    }
    return true;
}

bool scene_store_refresh(struct scene_store *store, enum store_kind kind,
    struct store_staging *staging, const uint8_t id[PEN_ID_BYTES], struct pen_error *error)
{
    char hex[PEN_ID_HEX + 1];
    struct store_entry entry;
    bool found = false;
    pen_id_to_hex(id, hex);
    int folder = openat(store->kinds[kind], hex, O_RDONLY | O_DIRECTORY | O_CLOEXEC | O_NOFOLLOW);
    bool ok = folder >= 0 && sync_file(staging->folder, kind_blobs[kind]) &&
              !renameat(staging->folder, kind_blobs[kind], folder, kind_blobs[kind]) &&
              !renameat(staging->folder, STORE_META, folder, STORE_META) && !fsync(folder);
    if (folder >= 0)
        close(folder);
    scene_store_discard(store, staging);
    if (!ok || !inspect(store, kind, hex, &entry))
        return pen_fail(error, PEN_UNAVAILABLE, "", "The store could not be written.");
    pthread_mutex_lock(&store->lock);
    uint32_t at = position(&store->lists[kind], id, &found);
    if (found) /* unless it was deleted meanwhile */
        store->lists[kind].entries[at] = entry;
    pthread_mutex_unlock(&store->lock);
    return true;
}
