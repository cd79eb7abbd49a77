#include "server/access/owners.h"
#include "protocol/memory.h"
#include "protocol/request.h"
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define LINE_BYTES (PEN_ID_HEX + 1 + 16 + 1)

struct row {
    uint8_t id[PEN_ID_BYTES];
    uint64_t owner;
};

struct owners {
    pthread_mutex_t lock; /* guards all below */
    char *path;
    struct row *rows;
    size_t count, capacity;
};

static void print_row(const struct row *row, char line[LINE_BYTES + 1])
{
    pen_id_to_hex(row->id, line);
    snprintf(line + PEN_ID_HEX, LINE_BYTES + 1 - PEN_ID_HEX, " %016llx\n",
        (unsigned long long)row->owner);
}

static void keep(struct owners *owners, const struct row *row)
{
    owners->rows =
        pen_grow(owners->rows, &owners->capacity, owners->count + 1, sizeof *owners->rows);
    owners->rows[owners->count++] = *row;
}

struct owners *owners_open(const char *path, struct pen_error *error)
{
    char line[256];
    FILE *file = fopen(path, "re");
    if (!file && errno != ENOENT) {
        pen_fail(error, PEN_UNAVAILABLE, "", "%.200s cannot be read: %s.", path, strerror(errno));
        return NULL;
    }
    struct owners *owners = pen_alloc_zero(1, sizeof *owners);
    pthread_mutex_init(&owners->lock, NULL);
    owners->path = strdup(path);
    while (file && fgets(line, sizeof line, file)) {
        struct row row;
        char *end;
        line[strcspn(line, "\n")] = 0;
        if (strlen(line) != LINE_BYTES - 1 || line[PEN_ID_HEX] != ' ')
            continue; /* cut short, or damaged: of what it says nobody is sure */
        line[PEN_ID_HEX] = 0;
        row.owner = strtoull(line + PEN_ID_HEX + 1, &end, 16);
        if (!*end && pen_id_from_hex(line, row.id))
            keep(owners, &row);
    }
    if (file)
        fclose(file);
    return owners;
}

void owners_close(struct owners *owners)
{
    if (!owners)
        return;
    pthread_mutex_destroy(&owners->lock);
    free(owners->path);
    free(owners->rows);
    free(owners);
}

/* Under the lock. */
static struct row *find(struct owners *owners, const uint8_t id[PEN_ID_BYTES], uint64_t owner)
{
    for (size_t i = 0; i < owners->count; i++)
        if (owners->rows[i].owner == owner && !memcmp(owners->rows[i].id, id, PEN_ID_BYTES))
            return &owners->rows[i];
    return NULL;
}

/* Under the lock: all rows, into a new file that takes the place of the old, so that no moment has
 * half of it. */
static bool write_all(struct owners *owners)
{
    char name[4096], line[LINE_BYTES + 1];
    snprintf(name, sizeof name, "%s.new", owners->path);
    FILE *file = fopen(name, "we");
    if (!file)
        return false;
    for (size_t i = 0; i < owners->count; i++) {
        print_row(&owners->rows[i], line);
        fputs(line, file);
    }
    bool ok = !fflush(file) && !ferror(file) && !fsync(fileno(file));
    return !fclose(file) && ok && !rename(name, owners->path);
}

bool owners_add(
    struct owners *owners, const uint8_t id[PEN_ID_BYTES], uint64_t owner, struct pen_error *error)
{
    struct row row = {.owner = owner};
    char line[LINE_BYTES + 1];
    memcpy(row.id, id, PEN_ID_BYTES);
    print_row(&row, line);
    pthread_mutex_lock(&owners->lock);
    bool ok = find(owners, id, owner) != NULL;
    if (!ok) {
        int fd = open(owners->path, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
        ok = fd >= 0 && write(fd, line, LINE_BYTES) == LINE_BYTES && !fdatasync(fd);
        if (fd >= 0)
            close(fd);
        keep(owners, &row);
    }
    pthread_mutex_unlock(&owners->lock);
    return ok || pen_fail(error, PEN_UNAVAILABLE, "", "Whose it is could not be written down.");
}

bool owners_has(struct owners *owners, const uint8_t id[PEN_ID_BYTES], uint64_t owner)
{
    pthread_mutex_lock(&owners->lock);
    bool has = find(owners, id, owner) != NULL;
    pthread_mutex_unlock(&owners->lock);
    return has;
}

uint32_t owners_remove(struct owners *owners, const uint8_t id[PEN_ID_BYTES], uint64_t owner)
{
    uint32_t left = 0;
    size_t before, kept = 0;
    pthread_mutex_lock(&owners->lock);
    before = owners->count;
    for (size_t i = 0; i < before; i++) {
        bool same = !memcmp(owners->rows[i].id, id, PEN_ID_BYTES);
        if (same && (!owner || owners->rows[i].owner == owner))
            continue;
        left += same;
        owners->rows[kept++] = owners->rows[i];
    }
    owners->count = kept;
    if (kept != before)
        write_all(owners); /* else the next one tries */
    pthread_mutex_unlock(&owners->lock);
    return left;
}

uint64_t owners_sum(struct owners *owners, uint64_t owner,
    uint64_t (*bytes)(void *context, const uint8_t id[PEN_ID_BYTES]), void *context)
{
    uint64_t sum = 0;
    size_t count = 0;
    pthread_mutex_lock(&owners->lock);
    struct row *copy = pen_alloc(owners->count, sizeof *copy);
    for (size_t i = 0; i < owners->count; i++)
        if (owners->rows[i].owner == owner)
            copy[count++] = owners->rows[i];
    pthread_mutex_unlock(&owners->lock);
    for (size_t i = 0; i < count; i++)
        sum += bytes(context, copy[i].id);
    free(copy);
    return sum;
}
