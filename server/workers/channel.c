#include "server/workers/channel.h"
#include <errno.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#define HEADER offsetof(struct channel_message, hello)

/* Bytes behind the header, by kind. */
static const size_t payload[CHANNEL_KINDS] = {
    [CHANNEL_HELLO] = sizeof(struct channel_hello),
    [CHANNEL_REFUSED] = sizeof(struct pen_error),
    [CHANNEL_WARM] = sizeof(struct channel_warm),
    [CHANNEL_PART] = sizeof(struct pen_result),
    [CHANNEL_TURN] = sizeof(struct channel_turn),
    [CHANNEL_DONE] = sizeof(struct pen_result),
    [CHANNEL_JOB] = sizeof(struct channel_job),
    [CHANNEL_RESIDENT] = sizeof(struct channel_resident),
    [CHANNEL_DROP] = sizeof(struct channel_drop),
};

bool channel_send(int socket, const struct channel_message *message, const struct channel_fds *fds)
{
    struct iovec part = {(void *)message, HEADER + payload[message->kind]};
    union {
        struct cmsghdr align;
        char bytes[CMSG_SPACE(sizeof(int) * CHANNEL_MAX_FDS)];
    } control;
    struct msghdr packet = {.msg_iov = &part, .msg_iovlen = 1};
    if (fds && fds->count) {
        memset(&control, 0, sizeof control);
        packet.msg_control = control.bytes;
        packet.msg_controllen = CMSG_SPACE(sizeof(int) * fds->count);
        struct cmsghdr *header = CMSG_FIRSTHDR(&packet);
        header->cmsg_level = SOL_SOCKET;
        header->cmsg_type = SCM_RIGHTS;
        header->cmsg_len = CMSG_LEN(sizeof(int) * fds->count);
        memcpy(CMSG_DATA(header), fds->fd, sizeof(int) * fds->count);
    }
    ssize_t sent;
    do
        sent = sendmsg(socket, &packet, MSG_NOSIGNAL);
    while (sent < 0 && errno == EINTR);
    return sent == (ssize_t)part.iov_len;
}

void channel_close_fds(struct channel_fds *fds)
{
    for (uint32_t i = 0; i < fds->count; i++)
        close(fds->fd[i]);
    fds->count = 0;
}

int channel_receive(int socket, struct channel_message *message, struct channel_fds *fds)
{
    fds->count = 0;
    struct iovec part = {message, sizeof *message};
    union {
        struct cmsghdr align;
        char bytes[CMSG_SPACE(sizeof(int) * CHANNEL_MAX_FDS)];
    } control;
    struct msghdr packet = {.msg_iov = &part,
        .msg_iovlen = 1,
        .msg_control = control.bytes,
        .msg_controllen = sizeof control.bytes};
    ssize_t got;
    do
        got = recvmsg(socket, &packet, MSG_CMSG_CLOEXEC);
    while (got < 0 && errno == EINTR);
    if (got <= 0)
        return got == 0 ? 0 : -1;
    for (struct cmsghdr *h = CMSG_FIRSTHDR(&packet); h; h = CMSG_NXTHDR(&packet, h)) {
        if (h->cmsg_level != SOL_SOCKET || h->cmsg_type != SCM_RIGHTS)
            continue;
        fds->count = (uint32_t)((h->cmsg_len - CMSG_LEN(0)) / sizeof(int));
        memcpy(fds->fd, CMSG_DATA(h), sizeof(int) * fds->count);
    }
    if ((packet.msg_flags & (MSG_TRUNC | MSG_CTRUNC)) || (size_t)got < HEADER ||
        message->version != CHANNEL_VERSION || message->kind == 0 ||
        message->kind >= CHANNEL_KINDS || (size_t)got != HEADER + payload[message->kind]) {
        channel_close_fds(fds);
        errno = EPROTO;
        return -1;
    }
    return 1;
}
