#include "server/uploads/upload.h"
#include "protocol/memory.h"
#include "renderer/import/names.h"
#include "server/base/hash.h"
#include "server/uploads/multipart.h"
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

#define SPOOL "parts" /* the files of a multipart body, one behind the other */

struct part {
    char name[PEN_BUNDLE_MAX_NAME + 1];
    uint64_t offset, bytes; /* in the spool */
};

struct upload {
    struct scene_store *store;
    struct store_staging staging;
    int file; /* the source, or the spool */
    uint64_t bytes, written, limit;
    struct hash *hash;
    struct multipart *multipart;         /* NULL: a raw body */
    char entry[PEN_BUNDLE_MAX_NAME + 1]; /* "": none was chosen */
    struct part *parts;
    uint32_t part_count;
    size_t part_capacity;
};

static bool write_all(
    struct upload *u, int fd, const void *data, size_t bytes, struct pen_error *error)
{
    const char *at = data;
    if (!scene_store_claim(u->store, &u->staging, bytes, error))
        return false;
    while (bytes) {
        ssize_t n = write(fd, at, bytes);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            return store_write_failed(errno, error);
        at += n;
        bytes -= (size_t)n;
    }
    return true;
}

static bool begin_part(void *context, const char *name, struct pen_error *error)
{
    struct upload *u = context;
    char tidy[PEN_BUNDLE_MAX_NAME + 1];
    if (!pen_name_tidy(name, strlen(name), tidy))
        return pen_fail(error, PEN_INVALID, "", "A file of the upload has an invalid name.");
    if (u->part_count == PEN_BUNDLE_MAX_ENTRIES)
        return pen_fail(
            error, PEN_TOO_BIG, "", "An upload has at most %d files.", PEN_BUNDLE_MAX_ENTRIES);
    u->parts = pen_grow(u->parts, &u->part_capacity, u->part_count + 1, sizeof *u->parts);
    struct part *part = &u->parts[u->part_count++];
    memcpy(part->name, tidy, sizeof part->name);
    part->offset = u->written;
    part->bytes = 0;
    return true;
}

static bool add_data(void *context, const void *data, size_t bytes, struct pen_error *error)
{
    struct upload *u = context;
    u->parts[u->part_count - 1].bytes += bytes;
    u->written += bytes;
    return write_all(u, u->file, data, bytes, error);
}

static bool put(struct upload *u, int to, const void *data, size_t bytes, struct pen_error *error)
{
    hash_add(u->hash, data, bytes);
    return write_all(u, to, data, bytes, error);
}

/* What bundle.h has before an upload of which one scene was chosen. */
static bool put_entry(struct upload *u, int to, struct pen_error *error)
{
    uint32_t head[2] = {(uint32_t)strlen(u->entry), 0};
    return !head[0] ||
           (put(u, to, PEN_ENTRY_MAGIC, 8, error) && put(u, to, head, sizeof head, error) &&
               put(u, to, u->entry, head[0], error));
}

struct upload *upload_create(struct scene_store *store, const char *content_type, const char *entry,
    uint64_t limit, struct pen_error *error)
{
    struct upload *u = pen_alloc_zero(1, sizeof *u);
    memcpy(u->entry, entry, strnlen(entry, sizeof u->entry - 1));
    u->store = store;
    u->limit = limit;
    u->file = u->staging.folder = -1;
    struct multipart_sink sink = {begin_part, add_data, u};
    bool is_multipart = !strncasecmp(content_type, "multipart/form-data", 19);
    if (is_multipart && !(u->multipart = multipart_create(content_type, &sink, error)))
        goto fail;
    if (!is_multipart)
        u->hash = hash_create();
    if (!scene_store_stage(store, &u->staging, error))
        goto fail;
    u->file = openat(u->staging.folder, is_multipart ? SPOOL : STORE_SOURCE,
        O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    if (u->file < 0) {
        store_write_failed(errno, error);
        goto fail;
    }
    if (!is_multipart && !put_entry(u, u->file, error))
        goto fail;
    return u;
fail:
    upload_destroy(u);
    return NULL;
}

void upload_destroy(struct upload *u)
{
    if (!u)
        return;
    if (u->file >= 0)
        close(u->file);
    scene_store_discard(u->store, &u->staging);
    hash_destroy(u->hash);
    multipart_destroy(u->multipart);
    free(u->parts);
    free(u);
}

bool upload_add(struct upload *u, const void *data, size_t bytes, struct pen_error *error)
{
    u->bytes += bytes;
    if (u->bytes > u->limit)
        return pen_fail(error, PEN_TOO_BIG, "", "An upload has at most %llu bytes.",
            (unsigned long long)u->limit);
    if (u->multipart)
        return multipart_add(u->multipart, data, bytes, error);
    hash_add(u->hash, data, bytes);
    return write_all(u, u->file, data, bytes, error);
}

static int by_name(const void *a, const void *b)
{
    return strcmp(((const struct part *)a)->name, ((const struct part *)b)->name);
}

static bool put_part(struct upload *u, int to, const struct part *part, struct pen_error *error)
{
    char piece[1 << 16];
    for (uint64_t done = 0; done < part->bytes;) {
        uint64_t left = part->bytes - done;
        ssize_t n = pread(u->file, piece, left < sizeof piece ? (size_t)left : sizeof piece,
            (off_t)(part->offset + done));
        if (n <= 0)
            return pen_fail(error, PEN_UNAVAILABLE, "", "The store could not be read.");
        if (!put(u, to, piece, (size_t)n, error))
            return false;
        done += (uint64_t)n;
    }
    return true;
}

/* Whatever it is called ("blob", when a program did not say): its bytes say what it is. A glTF that
 * is JSON has other files as a rule, and says which are missing. */
static bool stands_alone(const char *name)
{
    const char *dot = strrchr(name, '.');
    return !dot || strcasecmp(dot, ".gltf");
}

/* Spool to source: the bundle's header and entries, or the only file. */
static bool write_bundle(struct upload *u, struct pen_error *error)
{
    if (!u->part_count)
        return pen_fail(error, PEN_MALFORMED, "", "The upload holds no file.");
    qsort(u->parts, u->part_count, sizeof *u->parts, by_name);
    for (uint32_t i = 1; i < u->part_count; i++)
        if (!strcmp(u->parts[i - 1].name, u->parts[i].name))
            return pen_fail(error, PEN_INVALID, "", "Two files of the upload have the same name.");
    int to = openat(u->staging.folder, STORE_SOURCE, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    if (to < 0)
        return store_write_failed(errno, error);
    u->hash = hash_create();
    bool alone = u->part_count == 1 && stands_alone(u->parts[0].name);
    uint32_t head[2] = {u->part_count, 0};
    bool ok = put_entry(u, to, error);
    ok =
        ok &&
        (alone || (put(u, to, PEN_BUNDLE_MAGIC, 8, error) && put(u, to, head, sizeof head, error)));
    for (uint32_t i = 0; ok && i < u->part_count; i++) {
        const struct part *part = &u->parts[i];
        uint32_t name_bytes[2] = {(uint32_t)strlen(part->name), 0};
        ok = alone || (put(u, to, name_bytes, sizeof name_bytes, error) &&
                          put(u, to, &part->bytes, sizeof part->bytes, error) &&
                          put(u, to, part->name, name_bytes[0], error));
        ok = ok && put_part(u, to, part, error);
    }
    close(u->file);
    u->file = to;
    unlinkat(u->staging.folder, SPOOL, 0);
    scene_store_give_back(u->store, &u->staging, u->written);
    return ok;
}

bool upload_finish(struct upload *u, uint8_t id[PEN_ID_BYTES], struct pen_error *error)
{
    if (u->multipart && (!multipart_end(u->multipart, error) || !write_bundle(u, error)))
        return false;
    if (!u->bytes)
        return pen_fail(error, PEN_MALFORMED, "", "The upload is empty.");
    hash_finish(u->hash, id);
    u->hash = NULL;
    close(u->file);
    u->file = -1;
    return true;
}

struct store_staging *upload_staging(struct upload *u)
{
    return &u->staging;
}

uint64_t upload_bytes(const struct upload *u)
{
    return u->bytes;
}

const char *upload_name(const struct upload *u)
{
    if (*u->entry)
        return u->entry;
    for (uint32_t i = 0; i < u->part_count; i++)
        if (u->part_count == 1 || !stands_alone(u->parts[i].name))
            return u->parts[i].name;
    return "";
}
