#include "server/gallery/sealed.h"
#include "server/base/file.h"
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define HEAD "%016" PRIx64 "\n"
#define HEAD_BYTES 17

char *sealed_read(int folder, const char *name, size_t most, size_t *bytes, bool *damaged)
{
    char head[HEAD_BYTES + 1];
    size_t read;
    *damaged = false;
    int fd = openat(folder, name, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    if (fd < 0)
        return NULL;
    char *text = file_read(fd, HEAD_BYTES + most, &read);
    close(fd);
    if (text && read > HEAD_BYTES) {
        *bytes = read - HEAD_BYTES;
        snprintf(head, sizeof head, HEAD, sums_of(text + HEAD_BYTES, *bytes));
        if (!memcmp(head, text, HEAD_BYTES)) {
            memmove(text, text + HEAD_BYTES, *bytes + 1);
            return text;
        }
    }
    free(text);
    *damaged = true;
    return NULL;
}

static bool write_all(int fd, const void *data, size_t bytes)
{
    for (const char *at = data; bytes;) {
        ssize_t n = write(fd, at, bytes);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            return false;
        at += n;
        bytes -= (size_t)n;
    }
    return true;
}

bool sealed_write(int folder, const char *name, const void *data, size_t bytes, bool sync,
    struct pen_error *error)
{
    char part[64], head[HEAD_BYTES + 1];
    snprintf(part, sizeof part, "%.40s.part", name);
    snprintf(head, sizeof head, HEAD, sums_of(data, bytes));
    int fd = openat(folder, part, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600);
    bool ok = fd >= 0 && write_all(fd, head, HEAD_BYTES) && write_all(fd, data, bytes) &&
              (!sync || !fsync(fd)) && file_replace(folder, part, folder, name) &&
              (!sync || !fsync(folder));
    int failed = errno;
    if (fd >= 0)
        close(fd);
    if (!ok)
        unlinkat(folder, part, 0);
    return ok || store_write_failed(failed, error);
}

size_t sealed_bytes(size_t bytes)
{
    return HEAD_BYTES + bytes;
}
