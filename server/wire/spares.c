#include "server/wire/spares.h"
#include <errno.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <unistd.h>

#define UNLIMITED (1 << 30)

void spares_init(struct spares *spares, uint32_t count)
{
    memset(spares->fd, -1, sizeof spares->fd);
    spares->count = count < SPARES_MAX ? count : SPARES_MAX;
    spares_fill(spares);
}

void spares_finish(struct spares *spares)
{
    spares_give(spares, spares->count);
}

void spares_fill(struct spares *spares)
{
    for (uint32_t i = 0; i < spares->count; i++)
        if (spares->fd[i] < 0)
            spares->fd[i] = eventfd(0, EFD_CLOEXEC);
}

void spares_give(struct spares *spares, uint32_t count)
{
    for (uint32_t i = 0; i < spares->count && count; i++) {
        if (spares->fd[i] < 0)
            continue;
        close(spares->fd[i]);
        spares->fd[i] = -1;
        count--;
    }
}

bool spares_are_needed(void)
{
    return errno == EMFILE || errno == ENFILE || errno == ENOMEM || errno == ENOBUFS;
}

int spares_limit(void)
{
    struct rlimit files;
    bool known = !getrlimit(RLIMIT_NOFILE, &files) && files.rlim_cur < UNLIMITED;
    return known ? (int)files.rlim_cur : UNLIMITED;
}
