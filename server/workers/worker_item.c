#include "server/workers/worker_item.h"
#include "renderer/encode/encode.h"
#include <errno.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

/* A memfd that nobody can change any more, so that the front end may map it; -1 on failure. */
static int seal(const struct pen_bytes *bytes)
{
    int fd = memfd_create("penumbra-image", MFD_CLOEXEC | MFD_ALLOW_SEALING);
    if (fd < 0)
        return -1;
    for (size_t done = 0; done < bytes->size;) {
        ssize_t n = write(fd, bytes->data + done, bytes->size - done);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            goto fail;
        done += (size_t)n;
    }
    if (fcntl(fd, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE | F_SEAL_SEAL))
        goto fail;
    return fd;
fail:
    close(fd);
    return -1;
}

bool worker_item_hand_over(
    const struct pen_bytes *bytes, struct channel_fds *fds, struct pen_error *error)
{
    int fd = seal(bytes);
    if (fd < 0)
        return pen_fail(error, PEN_INTERNAL, "", "The image could not be handed over.");
    fds->fd[fds->count++] = fd;
    return true;
}

void worker_item_refuse_late(struct worker_item *item)
{
    struct pen_error *error = &item->message.result.error;
    *error = (struct pen_error){0};
    pen_fail(error, PEN_DEADLINE, "/deadline_ms", "Nothing of the image was ready in time.");
}
