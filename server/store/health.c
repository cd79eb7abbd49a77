/* What is opened is what was stored: checked, mended, or given up. */
#include "protocol/request.h"
#include "server/base/file.h"
#include "server/base/hash.h"
#include "server/base/log.h"
#include "server/store/scene_store.h"
#include "server/store/shelf.h"
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define RETRY_S 2 /* an import mostly takes less */

void scene_store_on_stale(struct scene_store *store, store_import *import, void *context)
{
    pthread_mutex_lock(&store->lock);
    store->import = import;
    store->import_context = context;
    pthread_mutex_unlock(&store->lock);
    for (int kind = 0; kind < STORE_KINDS; kind++) {
        struct store_entry entry;
        uint8_t after[PEN_ID_BYTES];
        for (bool first = true; scene_store_list(store, kind, first ? NULL : after, &entry, 1);
             first = false) {
            memcpy(after, entry.id, PEN_ID_BYTES);
            scene_store_is_ready(store, kind, entry.id, NULL);
        }
    }
}

bool scene_store_is_ready(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], struct pen_error *error)
{
    pthread_mutex_lock(&store->lock);
    struct store_entry *found = store_index_find(&store->lists[kind], id);
    struct store_entry entry = found ? *found : (struct store_entry){0};
    store_import *import = store->import;
    void *context = store->import_context;
    bool asks = entry.stale && !entry.importing && !entry.refused && import;
    if (asks)
        found->importing = true;
    pthread_mutex_unlock(&store->lock);
    if (asks)
        import(context, kind, id);
    const char *word = scene_store_word(kind);
    if (!found)
        return pen_fail(error, PEN_NOT_FOUND, "", "There is no such %s.", word);
    if (entry.refused)
        return pen_fail(error, PEN_INVALID, "",
            "This version no longer imports the %s as it was stored: upload it again to see why.",
            word);
    if (!entry.stale)
        return true;
    pen_fail(error, PEN_UNAVAILABLE, "", "The %s is being imported again.", word);
    if (error)
        error->retry_after_s = RETRY_S;
    return false;
}

void scene_store_not_refreshed(
    struct scene_store *store, enum store_kind kind, const uint8_t id[PEN_ID_BYTES], bool for_good)
{
    pthread_mutex_lock(&store->lock);
    struct store_entry *entry = store_index_find(&store->lists[kind], id);
    if (entry) {
        entry->importing = false;
        entry->refused = entry->stale && for_good;
    }
    pthread_mutex_unlock(&store->lock);
}

static int open_in(int folder, const char *name)
{
    return folder < 0 ? -1 : openat(folder, name, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
}

static int folder_of(
    struct scene_store *store, enum store_kind kind, const uint8_t id[PEN_ID_BYTES])
{
    char hex[PEN_ID_HEX + 1];
    pen_id_to_hex(id, hex);
    return scene_store_folder(store, kind, hex);
}

/* Opens a file that has a sum; -1 when it is not what it was. Whether there is such an entry at all
 * is not asked. `again`: it is read whatever is known of it. */
static int open_checked(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], bool meta, bool again)
{
    const char *name = meta ? STORE_META : scene_store_blob_name(kind);
    struct store_entry entry = {0};
    if (!again)
        scene_store_find(store, kind, id, &entry);
    struct sums_mark *mark = meta ? &entry.meta_mark : &entry.blob_mark;
    int folder = folder_of(store, kind, id), fd = open_in(folder, name);
    bool right = fd >= 0 && sums_are_right(folder, name, fd, mark);
    if (right) {
        pthread_mutex_lock(&store->lock);
        struct store_entry *found = store_index_find(&store->lists[kind], id);
        if (found)
            *(meta ? &found->meta_mark : &found->blob_mark) = *mark;
        pthread_mutex_unlock(&store->lock);
    }
    if (folder >= 0)
        close(folder);
    if (right)
        return fd;
    if (fd >= 0)
        close(fd);
    return -1;
}

/* For lack of descriptors a file is not damaged. */
static bool is_lack(int reason)
{
    return reason == EMFILE || reason == ENFILE || reason == ENOMEM;
}

static void report(struct scene_store *store, enum store_kind kind, const uint8_t id[PEN_ID_BYTES],
    const char *what)
{
    char hex[PEN_ID_HEX + 1];
    pen_id_to_hex(id, hex);
    pthread_mutex_lock(&store->lock);
    store->faults++;
    pthread_mutex_unlock(&store->lock);
    log_event(LOG_ERROR, "%s %s: %s", scene_store_word(kind), hex, what);
}

int scene_store_open_blob(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], struct pen_error *error)
{
    if (!scene_store_is_ready(store, kind, id, error))
        return -1;
    errno = 0;
    int fd = open_checked(store, kind, id, false, false);
    if (fd >= 0)
        return fd;
    if (is_lack(errno)) {
        pen_fail(error, PEN_UNAVAILABLE, "", "The service is out of descriptors.");
        return -1;
    }
    pthread_mutex_lock(&store->lock);
    struct store_entry *entry = store_index_find(&store->lists[kind], id);
    bool news = entry && !entry->stale;
    if (entry)
        entry->stale = true;
    pthread_mutex_unlock(&store->lock);
    if (news)
        report(store, kind, id, "the blob in the store is damaged; it is made again");
    scene_store_is_ready(store, kind, id, error);
    return -1;
}

int scene_store_open_source(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], struct pen_error *error)
{
    struct stat status;
    int folder = folder_of(store, kind, id), fd = open_in(folder, STORE_SOURCE);
    if (fd >= 0 && !fstat(fd, &status) && !S_ISREG(status.st_mode)) {
        close(fd);
        fd = -1;
        errno = ENOENT;
    }
    if (fd < 0 && (errno == ENOENT || errno == ENOTDIR || errno == ELOOP))
        pen_fail(error, PEN_NOT_FOUND, "", "There is no such %s.", scene_store_word(kind));
    else if (fd < 0)
        pen_fail(error, PEN_UNAVAILABLE, "", "The store could not be read.");
    if (folder >= 0)
        close(folder);
    return fd;
}

int scene_store_open_meta(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], struct pen_error *error)
{
    if (!scene_store_find(store, kind, id, NULL)) {
        pen_fail(error, PEN_NOT_FOUND, "", "There is no such %s.", scene_store_word(kind));
        return -1;
    }
    int fd = open_checked(store, kind, id, true, false);
    if (fd < 0)
        pen_fail(error, PEN_UNAVAILABLE, "", "The description in the store is damaged.");
    return fd;
}

int scene_store_open_folder(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], struct pen_error *error)
{
    int folder = folder_of(store, kind, id);
    if (folder < 0)
        pen_fail(error, PEN_NOT_FOUND, "", "There is no such %s.", scene_store_word(kind));
    return folder;
}

static bool has_source(
    struct scene_store *store, enum store_kind kind, const uint8_t id[PEN_ID_BYTES])
{
    uint8_t digest[PEN_ID_BYTES];
    int source = scene_store_open_source(store, kind, id, NULL);
    bool has = source >= 0 && hash_file(source, digest) && !memcmp(digest, id, PEN_ID_BYTES);
    if (source >= 0)
        close(source);
    return has;
}

bool scene_store_is_sound(
    struct scene_store *store, enum store_kind kind, const uint8_t id[PEN_ID_BYTES])
{
    struct store_entry entry;
    if (!scene_store_find(store, kind, id, &entry) || entry.stale)
        return false;
    bool sound = has_source(store, kind, id);
    for (int meta = 0; sound && meta < 2; meta++) {
        int fd = open_checked(store, kind, id, meta, true);
        sound = fd >= 0;
        if (sound)
            close(fd);
    }
    return sound;
}

void scene_store_scrub(
    struct scene_store *store, enum store_kind kind, const uint8_t id[PEN_ID_BYTES])
{
    bool has = has_source(store, kind, id);
    pthread_mutex_lock(&store->lock);
    struct store_entry *entry = store_index_find(&store->lists[kind], id);
    bool is_news = entry && !has && !entry->stale && !entry->sourceless;
    if (entry) {
        entry->sourceless = !has;
        entry->blob_mark = entry->meta_mark = (struct sums_mark){0};
    }
    pthread_mutex_unlock(&store->lock);
    if (is_news)
        report(store, kind, id,
            "the source in the store is damaged; the blob is whole, an upload would mend it");
    int blob = entry ? scene_store_open_blob(store, kind, id, NULL) : -1;
    if (blob >= 0)
        close(blob);
}

uint64_t scene_store_faults(struct scene_store *store)
{
    pthread_mutex_lock(&store->lock);
    uint64_t faults = store->faults;
    pthread_mutex_unlock(&store->lock);
    return faults;
}

void scene_store_lose(
    struct scene_store *store, enum store_kind kind, const uint8_t id[PEN_ID_BYTES])
{
    char hex[PEN_ID_HEX + 1];
    pen_id_to_hex(id, hex);
    scene_store_leave(store, kind, id);
    scene_store_put_aside(store, kind, hex);
}

bool scene_store_mend_meta(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], const char *text)
{
    const char *const names[] = {scene_store_blob_name(kind), STORE_META};
    char part[32];
    size_t bytes = strlen(text);
    int folder = folder_of(store, kind, id);
    scene_store_new_name(store, part);
    int fd = folder < 0 ? -1 : openat(folder, part, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    bool ok = fd >= 0 && write(fd, text, bytes) == (ssize_t)bytes && !fsync(fd) &&
              file_replace(folder, part, folder, STORE_META) && sums_write(folder, names, 2);
    if (fd >= 0)
        close(fd);
    if (folder >= 0) {
        unlinkat(folder, part, 0);
        close(folder);
    }
    report(store, kind, id,
        ok ? "the description in the store was damaged and is made again"
           : "the description in the store is damaged and cannot be made again");
    return ok;
}
