#include "server/store/shelf.h"
#include "protocol/request.h"
#include "renderer/blob/pscene.h"
#include "server/base/file.h"
#include "server/base/log.h"
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

const char *const scene_store_folders[STORE_KINDS] = {"scenes", "images"};
static const char *const kind_blobs[STORE_KINDS] = {"scene.pscene", "image.pscene"};

const char *scene_store_blob_name(enum store_kind kind)
{
    return kind_blobs[kind];
}

const char *scene_store_word(enum store_kind kind)
{
    return kind == STORE_SCENES ? "scene" : "image";
}

bool scene_store_find(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], struct store_entry *entry)
{
    pthread_mutex_lock(&store->lock);
    const struct store_entry *found = store_index_find(&store->lists[kind], id);
    if (found && entry)
        *entry = *found;
    pthread_mutex_unlock(&store->lock);
    return found;
}

uint32_t scene_store_list(struct scene_store *store, enum store_kind kind, const uint8_t *after,
    struct store_entry *entries, uint32_t limit)
{
    bool found = false;
    pthread_mutex_lock(&store->lock);
    const struct store_index *list = &store->lists[kind];
    uint32_t at = after ? store_index_position(list, after, &found) : 0;
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

void scene_store_new_name(struct scene_store *store, char name[32])
{
    pthread_mutex_lock(&store->lock);
    uint64_t number = ++store->next_name;
    pthread_mutex_unlock(&store->lock);
    snprintf(name, 32, "%llu", (unsigned long long)number);
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

int scene_store_folder(struct scene_store *store, enum store_kind kind, const char *name)
{
    return openat(store->kinds[kind], name, O_RDONLY | O_DIRECTORY | O_CLOEXEC | O_NOFOLLOW);
}

bool scene_store_inspect(
    struct scene_store *store, enum store_kind kind, const char *name, struct store_entry *entry)
{
    memset(entry, 0, sizeof *entry);
    int folder = scene_store_folder(store, kind, name);
    if (!pen_id_from_hex(name, entry->id) || folder < 0)
        return false;
    struct stat status;
    bool has_source =
        !fstatat(folder, STORE_SOURCE, &status, AT_SYMLINK_NOFOLLOW) && S_ISREG(status.st_mode);
    entry->source_bytes = has_source ? (uint64_t)status.st_size : 0;
    entry->stored_unix_s = has_source ? status.st_mtim.tv_sec : 0;
    bool has_thumbnail =
        !fstatat(folder, STORE_THUMBNAIL, &status, AT_SYMLINK_NOFOLLOW) && S_ISREG(status.st_mode);
    entry->thumbnail_bytes = has_thumbnail ? (uint64_t)status.st_size : 0;
    entry->stale = !is_good_blob(folder, kind, entry->id, &entry->blob_bytes);
    close(folder);
    return has_source || !entry->stale;
}

void scene_store_enter(struct scene_store *store, enum store_kind kind,
    const struct store_entry *entry, uint64_t claimed)
{
    pthread_mutex_lock(&store->lock);
    const struct store_entry *before = store_index_find(&store->lists[kind], entry->id);
    store_quota_settle(
        store->quota, claimed + (before ? store_entry_size(before) : 0), store_entry_size(entry));
    store_index_insert(&store->lists[kind], entry);
    pthread_mutex_unlock(&store->lock);
}

void scene_store_renew(
    struct scene_store *store, enum store_kind kind, const struct store_entry *entry)
{
    pthread_mutex_lock(&store->lock);
    struct store_entry *found = store_index_find(&store->lists[kind], entry->id);
    if (found) {
        store_quota_settle(store->quota, store_entry_size(found), store_entry_size(entry));
        *found = *entry;
    }
    pthread_mutex_unlock(&store->lock);
}

void scene_store_set_thumbnail(
    struct scene_store *store, const uint8_t id[PEN_ID_BYTES], uint64_t bytes, uint64_t claimed)
{
    pthread_mutex_lock(&store->lock);
    struct store_entry *found = store_index_find(&store->lists[STORE_SCENES], id);
    uint64_t before = found ? store_entry_size(found) : 0;
    if (found)
        found->thumbnail_bytes = bytes;
    store_quota_settle(store->quota, claimed + before, found ? store_entry_size(found) : 0);
    pthread_mutex_unlock(&store->lock);
}

void scene_store_leave(
    struct scene_store *store, enum store_kind kind, const uint8_t id[PEN_ID_BYTES])
{
    pthread_mutex_lock(&store->lock);
    const struct store_entry *entry = store_index_find(&store->lists[kind], id);
    store_quota_settle(store->quota, entry ? store_entry_size(entry) : 0, 0);
    store_index_remove(&store->lists[kind], id);
    pthread_mutex_unlock(&store->lock);
}

void scene_store_put_aside(struct scene_store *store, enum store_kind kind, const char *name)
{
    char to[96];
    snprintf(to, sizeof to, "%s-%.80s", scene_store_word(kind), name);
    file_remove_all(store->damaged, to); /* what was lost under this name before */
    if (renameat(store->kinds[kind], name, store->damaged, to))
        log_event(LOG_ERROR, "%s/%.80s in the store is damaged and cannot be moved: %s",
            scene_store_folders[kind], name, strerror(errno));
    else
        log_event(LOG_ERROR, "%s/%.80s in the store is lost: its files are in damaged/%s",
            scene_store_folders[kind], name, to);
}
