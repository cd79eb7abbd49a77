#include "server/store/sums.h"
#include "protocol/memory.h"
#include "server/base/file.h"
#include <fcntl.h>
#include <inttypes.h>
#include <isa-l/crc64.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define PIECE (1u << 20)
#define MAX_SUMS 4096
#define LINE "%016" PRIx64 " %" PRIu64 " "

struct sum {
    uint64_t crc, bytes;
};

static bool add_up(int file, struct sum *sum)
{
    uint8_t *piece = pen_alloc(1, PIECE);
    ssize_t n;
    memset(sum, 0, sizeof *sum);
    while ((n = pread(file, piece, PIECE, (off_t)sum->bytes)) > 0) {
        sum->crc = crc64_ecma_refl(sum->crc, piece, (uint64_t)n);
        sum->bytes += (uint64_t)n;
    }
    free(piece);
    return !n;
}

uint64_t sums_of(const void *data, size_t bytes)
{
    return crc64_ecma_refl(0, data, (uint64_t)bytes);
}

static struct sums_mark mark_of(const struct stat *status)
{
    return (struct sums_mark){(uint64_t)status->st_ino, (uint64_t)status->st_size,
        status->st_mtim.tv_sec * 1000000000 + status->st_mtim.tv_nsec,
        status->st_ctim.tv_sec * 1000000000 + status->st_ctim.tv_nsec};
}

bool sums_write(int folder, const char *const *names, uint32_t count)
{
    static const char part[] = STORE_SUMS ".part";
    char text[MAX_SUMS];
    size_t at = 0;
    bool ok = true;
    for (uint32_t i = 0; ok && i < count; i++) {
        struct sum sum = {0};
        int file = openat(folder, names[i], O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
        ok = file >= 0 && add_up(file, &sum);
        if (file >= 0)
            close(file);
        at += (size_t)snprintf(
            text + at, sizeof text - at, LINE "%s\n", sum.crc, sum.bytes, names[i]);
        ok = ok && at < sizeof text;
    }
    int to =
        ok ? openat(folder, part, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600) : -1;
    ok = to >= 0 && write(to, text, at) == (ssize_t)at && !fsync(to) &&
         file_replace(folder, part, folder, STORE_SUMS);
    if (to >= 0)
        close(to);
    return ok;
}

static bool look_up(int folder, const char *name, struct sum *sum)
{
    int from = openat(folder, STORE_SUMS, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    size_t bytes;
    char *text = from >= 0 ? file_read(from, MAX_SUMS, &bytes) : NULL, *rest = text;
    bool found = false;
    for (char *line; !found && rest && (line = strsep(&rest, "\n"));) {
        int end = 0;
        found = sscanf(line, "%16" SCNx64 " %20" SCNu64 " %n", &sum->crc, &sum->bytes, &end) == 2 &&
                end && !strcmp(line + end, name);
    }
    free(text);
    if (from >= 0)
        close(from);
    return found;
}

bool sums_are_right(int folder, const char *name, int file, struct sums_mark *mark)
{
    struct stat before, after;
    struct sum written, found;
    if (fstat(file, &before))
        return false;
    struct sums_mark now = mark_of(&before);
    if (mark && !memcmp(mark, &now, sizeof now))
        return true;
    if (!look_up(folder, name, &written) || written.bytes != now.bytes || !add_up(file, &found) ||
        found.bytes != written.bytes || found.crc != written.crc || fstat(file, &after))
        return false;
    /* Who writes meanwhile is seen the next time. */
    struct sums_mark then = mark_of(&after);
    if (mark && !memcmp(&then, &now, sizeof now))
        *mark = now;
    return true;
}
