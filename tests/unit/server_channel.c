/* Messages between processes: what arrives, with its descriptors, and what is not let in. */
#include "server/workers/channel.h"
#include "tests/unit/check.h"
#include <errno.h>
#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

static int count_fds(void)
{
    int count = 0;
    for (int fd = 0; fd < 256; fd++)
        count += fcntl(fd, F_GETFD) >= 0;
    return count;
}

static void test_round_trip(const int pair[2])
{
    static struct channel_message out, in;
    struct channel_fds fds = {0}, got;
    int pipe_fds[2];
    CHECK(pipe(pipe_fds) == 0);
    fds.count = CHANNEL_MAX_FDS;
    for (int i = 0; i < CHANNEL_MAX_FDS; i++)
        fds.fd[i] = pipe_fds[1];
    out.version = CHANNEL_VERSION;
    out.kind = CHANNEL_JOB;
    out.job = 1ull << 60;
    out.job_data.request.width = 123;
    out.job_data.image_count = 8;
    out.job_data.images[7][31] = 0xee;
    CHECK(channel_send(pair[0], &out, &fds));
    CHECK(channel_receive(pair[1], &in, &got) == 1);
    CHECK(in.kind == CHANNEL_JOB && in.job == 1ull << 60);
    CHECK(!memcmp(&in.job_data, &out.job_data, sizeof in.job_data));
    CHECK(got.count == CHANNEL_MAX_FDS);
    CHECK(write(got.fd[8], "x", 1) == 1);
    char c = 0;
    CHECK(read(pipe_fds[0], &c, 1) == 1 && c == 'x');
    CHECK(fcntl(got.fd[0], F_GETFD) & FD_CLOEXEC);
    channel_close_fds(&got);
    close(pipe_fds[0]);
    close(pipe_fds[1]);
    out.kind = CHANNEL_STARTED;
    CHECK(channel_send(pair[0], &out, NULL));
    CHECK(channel_receive(pair[1], &in, &got) == 1 && got.count == 0);
}

static void test_refused(const int pair[2])
{
    static struct channel_message in;
    static union {
        uint32_t words[2];
        char bytes[sizeof(struct channel_message) + 64];
    } raw;
    struct channel_fds got;
    const struct {
        uint32_t version, kind;
        size_t bytes;
    } rows[] = {{CHANNEL_VERSION + 1, CHANNEL_STARTED, 16}, {CHANNEL_VERSION, 0, 16},
        {CHANNEL_VERSION, CHANNEL_KINDS, 16}, {CHANNEL_VERSION, CHANNEL_STARTED, 15},
        {CHANNEL_VERSION, CHANNEL_STARTED, 17}, {CHANNEL_VERSION, CHANNEL_HELLO, 16},
        {CHANNEL_VERSION, CHANNEL_DONE, 100}, {CHANNEL_VERSION, CHANNEL_DONE, sizeof raw}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        raw.words[0] = rows[i].version;
        raw.words[1] = rows[i].kind;
        CHECK(send(pair[0], raw.bytes, rows[i].bytes, 0) == (ssize_t)rows[i].bytes);
        errno = 0;
        CHECK(channel_receive(pair[1], &in, &got) == -1 && errno == EPROTO);
    }
}

int main(void)
{
    int pair[2], before = count_fds();
    CHECK(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, pair) == 0);
    test_round_trip(pair);
    test_refused(pair);
    static struct channel_message in;
    struct channel_fds got;
    close(pair[0]);
    CHECK(channel_receive(pair[1], &in, &got) == 0);
    static struct channel_message out = {CHANNEL_VERSION, CHANNEL_STARTED, 0};
    CHECK(!channel_send(pair[1], &out, NULL)); /* and no SIGPIPE */
    close(pair[1]);
    CHECK(count_fds() == before);
    CHECK_DONE();
}
