/* A connection between a client and the HTTP library, both played here over pairs of sockets: what of
 * its bytes reaches the library, what of the library's the client, and when anything moves. */
#include "server/base/clock.h"
#include "server/wire/link.h"
#include "tests/unit/check.h"
#include <errno.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

struct ends {
    int client; /* the client's own end */
    int far;    /* the library's; -1: no request has come */
    uint32_t refused;
};

static void open_far(void *context, struct link *link, int far)
{
    (void)link;
    ((struct ends *)context)->far = far;
}

static void detach(void *context, struct link *link, int far)
{
    (void)context, (void)link, (void)far;
}

static void relieve(void *context)
{
    (void)context;
}

static void refused(
    void *context, const struct link *link, const struct pen_error *error, const char *id)
{
    (void)link, (void)error, (void)id;
    ((struct ends *)context)->refused++;
}

static struct link_config config;

static struct link *make(struct ends *ends)
{
    int pair[2];
    struct sockaddr_storage from = {.ss_family = AF_INET};
    *ends = (struct ends){.far = -1};
    config = (struct link_config){.epoll = epoll_create1(0),
        .header_timeout_ms = 60000,
        .keep_alive_ms = 60000,
        .body_rate = 1,
        .open = open_far,
        .detach = detach,
        .relieve = relieve,
        .refused = refused,
        .context = ends,
        .highest = 1000};
    CHECK(!socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, pair));
    ends->client = pair[0];
    return link_create(&config, pair[1], &from, NULL);
}

static void end(struct link *link, struct ends *ends)
{
    link_destroy(link);
    close(ends->client);
    if (ends->far >= 0)
        close(ends->far);
    close(config.epoll);
}

static void say(int fd, const char *text)
{
    CHECK(write(fd, text, strlen(text)) == (ssize_t)strlen(text));
}

/* What has come by now. */
static const char *hear(int fd)
{
    static char text[4096];
    ssize_t n = recv(fd, text, sizeof text - 1, MSG_DONTWAIT);
    text[n > 0 ? n : 0] = 0;
    return text;
}

#define POST "POST /x HTTP/1.1\r\nHost: x\r\n"
#define ANSWER "HTTP/1.1 200 OK\r\nContent-Length: 0\r\n\r\n"

/* In one piece and byte by byte. */
static void test_chunks(void)
{
    static const char body[] = "3;a=b\r\nabc\r\n0 \r\nX: y\r\n\r\n",
                      behind[] = "GET /y HTTP/1.1\r\n";
    for (int bytewise = 0; bytewise < 2; bytewise++) {
        struct ends ends;
        struct link *link = make(&ends);
        say(ends.client, POST "Transfer-Encoding: chunked\r\n\r\n");
        link_pump(link, 0);
        CHECK(ends.far >= 0);
        CHECK_STR(hear(ends.far), POST "Transfer-Encoding: chunked\r\n\r\n");
        for (size_t i = 0; bytewise && i < sizeof body - 1; i++) {
            say(ends.client, (char[]){body[i], 0});
            link_pump(link, 0);
        }
        if (!bytewise)
            say(ends.client, body);
        say(ends.client, behind);
        link_pump(link, 0);
        CHECK_STR(hear(ends.far), "3\r\nabc\r\n0\r\n\r\n");
        CHECK(link->state == LINK_ANSWER && !ends.refused);
        end(link, &ends);
    }
}

/* What the library would take apart is hidden from it. */
static void test_veil(void)
{
    struct ends ends;
    struct link *link = make(&ends);
    say(ends.client, "GET /a?b=?&c HTTP/1.1\r\nHost: x?y\r\nCookie: a=b\r\nCookies: c\r\n\r\n");
    link_pump(link, 0);
    CHECK(ends.refused == 1); /* no host's name has a question mark */
    end(link, &ends);
    link = make(&ends);
    say(ends.client, "\r\nGET /a?b=?&c HTTP/1.1\r\nHost: x\r\ncookie: a=b\r\nCookies: c?\r\n\r\n");
    link_pump(link, 0);
    CHECK_STR(
        hear(ends.far), "GET /a#b=?&c HTTP/1.1\r\nHost: x\r\n-ookie: a=b\r\nCookies: c?\r\n\r\n");
    end(link, &ends);
}

/* http.c says it, and then perhaps the library. */
static void test_continue(void)
{
    static const char *const said[] = {HTTP_CONTINUE ANSWER, HTTP_CONTINUE HTTP_CONTINUE ANSWER};
    for (int i = 0; i < 2; i++)
        for (int apart = 0; apart < 2; apart++) {
            struct ends ends;
            struct link *link = make(&ends);
            say(ends.client, POST "Content-Length: 2\r\nExpect: 100-continue\r\n\r\n");
            link_pump(link, 0);
            for (int times = 0; apart && times <= i; times++) {
                say(ends.far, HTTP_CONTINUE);
                link_pump(link, 0);
                CHECK(!link->answered);
            }
            say(ends.far, apart ? ANSWER : said[i]);
            link_pump(link, 0);
            CHECK_STR(hear(ends.client), HTTP_CONTINUE ANSWER);
            CHECK(link->answered);
            end(link, &ends);
        }
}

/* Looking whether a thousand clients are too slow reads from none of them. */
static void test_check(void)
{
    struct ends ends;
    struct link *link = make(&ends);
    say(ends.client, "GET");
    link_check(link, clock_now_ns());
    CHECK(link->state == LINK_WAITING);
    link_pump(link, 0);
    CHECK(link->state == LINK_HEAD);
    link_check(link, clock_now_ns() + 59 * CLOCK_S);
    CHECK(link->state == LINK_HEAD && !ends.refused);
    link_check(link, clock_now_ns() + 61 * CLOCK_S);
    CHECK(ends.refused == 1);
    CHECK(!strncmp(hear(ends.client), "HTTP/1.1 408 ", 13));
    end(link, &ends);
}

int main(void)
{
    test_chunks();
    test_veil();
    test_continue();
    test_check();
    CHECK_DONE();
}
