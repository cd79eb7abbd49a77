#include "server/wire/link.h"
#include "protocol/memory.h"
#include "server/base/clock.h"
#include "server/base/request_id.h"
#include "server/base/status.h"
#include <errno.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#define UP_BYTES (32u << 10) /* a header must fit */
#define DOWN_BYTES (64u << 10)
#define STREAM_BYTES (8u << 10)
#define PAIR_BYTES (64 << 10) /* what the kernel keeps between the library and us */
#define UNSENT                                                                                     \
    (128 << 10) /* what the kernel may hold of an answer that is not on its way yet: a
                              client that does not read could fill megabytes; and of a stream */
#define STREAM_UNSENT (16 << 10)
#define BODY_GRACE_NS (5 * CLOCK_S)
#define SEND_GRACE_NS (30 * CLOCK_S)
#define SEND_RATE (16u << 10) /* bytes per second a client must read at least */
#define BRISK 16              /* times the least rate: nobody else may have the place */
#define ENDING_NS (5 * CLOCK_S)
#define LINGER_NS (2 * CLOCK_S)
#define LINGER_BYTES (64u << 20)
#define ROUNDS 32 /* then others have their turn */
#define PROBLEM_BYTES 2048

_Static_assert(UP_BYTES > FRAMING_MAX_HEAD, "a header fits");

/* ---- bytes ---- */

static uint32_t held(const struct flow *flow)
{
    return flow->to - flow->from;
}

/* Room behind what is held, `capacity` bytes in all; 0: full. */
static uint32_t make_room(struct flow *flow, uint32_t capacity)
{
    if (flow->capacity < capacity) {
        flow->data = pen_realloc_array(flow->data, capacity, 1);
        flow->capacity = capacity;
    }
    if (flow->from) {
        memmove(flow->data, flow->data + flow->from, held(flow));
        flow->to -= flow->from;
        flow->from = 0;
    }
    return flow->to < capacity ? capacity - flow->to : 0;
}

static void empty(struct flow *flow)
{
    free(flow->data);
    *flow = (struct flow){0};
}

#define AGAIN TLS_AGAIN
#define BROKEN TLS_BROKEN

static int64_t result_of(ssize_t n)
{
    return n >= 0 ? n : errno == EAGAIN || errno == EINTR ? AGAIN : BROKEN;
}

static int64_t client_read(struct link *link, void *to, size_t most)
{
    return link->tls ? tls_read(link->tls, to, most)
                     : result_of(recv(link->client, to, most, MSG_DONTWAIT));
}

static int64_t client_write(struct link *link, const void *from, size_t bytes)
{
    return link->tls ? tls_write(link->tls, from, bytes)
                     : result_of(send(link->client, from, bytes, MSG_DONTWAIT | MSG_NOSIGNAL));
}

static void limit_unsent(struct link *link, int bytes)
{
    setsockopt(link->client, IPPROTO_TCP, TCP_NOTSENT_LOWAT, &bytes, sizeof bytes);
}

/* ---- from one state to the next ---- */

static void enter(struct link *link, enum link_state state)
{
    link->state = state;
    link->since_ns = clock_now_ns();
}

/* A child that has just been forked still has a copy of every descriptor: closing alone would leave
 * the socket open, and its events coming, until it executes its program. */
static void leave(struct link *link, int fd)
{
    epoll_ctl(link->config->epoll, EPOLL_CTL_DEL, fd, NULL);
    shutdown(fd, SHUT_RDWR);
    close(fd);
}

static void close_inner(struct link *link)
{
    if (link->inner < 0)
        return;
    link->config->detach(link->config->context, link, link->far);
    leave(link, link->inner);
    link->inner = link->far = -1;
    link->inner_events = 0;
    link->vetted = 0;
}

void link_cut(struct link *link)
{
    close_inner(link);
    link->state = LINK_DEAD;
}

/* The last byte is out. */
static void part(struct link *link)
{
    int unread = 0;
    bool all_read = link->state != LINK_BODY && !held(&link->up) &&
                    !ioctl(link->client, FIONREAD, &unread) && !unread;
    close_inner(link);
    if (link->tls)
        tls_close(link->tls);
    if (link->eof || (all_read && link->state != LINK_ENDING)) {
        link->state = LINK_DEAD;
        return;
    }
    shutdown(link->client, SHUT_WR);
    empty(&link->up);
    link->received = 0;
    enter(link, LINK_LINGERING);
}

void link_refuse(struct link *link, const struct pen_error *error)
{
    char id[REQUEST_ID_BYTES] = "", retry[40] = "";
    if (link->answered || link->state >= LINK_ENDING) {
        part(link);
        return;
    }
    request_id_make(id);
    bool no_body = held(&link->up) >= 5 && !memcmp(link->up.data + link->up.from, "HEAD ", 5);
    struct http_status told = http_status_of(error->code);
    char *body = http_problem(error, id);
    if (told.retryable)
        snprintf(retry, sizeof retry, "Retry-After: %u\r\n",
            error->retry_after_s ? error->retry_after_s : 1);
    close_inner(link);
    empty(&link->up);
    empty(&link->down);
    make_room(&link->down, PROBLEM_BYTES);
    int n = snprintf(link->down.data, PROBLEM_BYTES,
        "HTTP/1.1 %u %s\r\nContent-Type: application/problem+json\r\nContent-Length: %zu\r\n"
        "X-Request-Id: %s\r\nX-Content-Type-Options: nosniff\r\nCache-Control: no-store\r\n"
        "%sConnection: close\r\n\r\n%s",
        told.status, told.title, strlen(body), id, retry, no_body ? "" : body);
    link->down.to = (uint32_t)n;
    free(body);
    enter(link, LINK_ENDING);
    link->config->refused(link->config->context, link, error, id);
}

static bool open_inner(struct link *link)
{
    int pair[2], bytes = PAIR_BYTES;
    const int kind = SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK;
    if (socketpair(AF_UNIX, kind, 0, pair)) {
        link->config->relieve(link->config->context);
        if (socketpair(AF_UNIX, kind, 0, pair))
            return false;
    }
    struct epoll_event event = {.events = EPOLLIN, .data.ptr = &link->ears[1]};
    if (pair[1] > link->config->highest ||
        epoll_ctl(link->config->epoll, EPOLL_CTL_ADD, pair[0], &event)) {
        close(pair[0]);
        close(pair[1]);
        return false;
    }
    setsockopt(pair[1], SOL_SOCKET, SO_SNDBUF, &bytes, sizeof bytes);
    link->inner = pair[0];
    link->far = pair[1];
    link->inner_events = EPOLLIN;
    link->answered = link->continued = link->eof_told = link->deaf = link->over = false;
    __atomic_store_n(&link->notes, 0, __ATOMIC_RELEASE);
    link->config->open(link->config->context, link, link->far);
    return true;
}

/* The answer is out, and another request may follow. */
static void conclude(struct link *link, uint32_t notes)
{
    bool last = link->state != LINK_ANSWER || link->vetted || link->framing.closes || link->eof ||
                (notes & LINK_CLOSES);
    if (last) {
        part(link);
        return;
    }
    close_inner(link);
    if (notes & LINK_STREAMS)
        limit_unsent(link, UNSENT);
    empty(&link->down);
    if (!held(&link->up))
        empty(&link->up);
    framing_init(&link->framing);
    link->served = true;
    link->answered = false;
    enter(link, held(&link->up) ? LINK_HEAD : LINK_WAITING);
}

/* ---- the four ways, each true when something moved ---- */

static bool wants_bytes(const struct link *link)
{
    return link->state <= LINK_HEAD || (link->state == LINK_BODY && !link->deaf);
}

static bool read_client(struct link *link)
{
    if (link->state == LINK_LINGERING) {
        char scrap[16384];
        ssize_t n = recv(link->client, scrap, sizeof scrap, MSG_DONTWAIT);
        link->received += n > 0 ? (uint64_t)n : 0;
        if (n == 0 || (n < 0 && errno != EAGAIN && errno != EINTR) || link->received > LINGER_BYTES)
            link->state = LINK_DEAD;
        return n > 0;
    }
    uint32_t room = wants_bytes(link) && !link->eof ? make_room(&link->up, UP_BYTES) : 0;
    if (!room)
        return false;
    int64_t n = client_read(link, link->up.data + link->up.to, room);
    if (n == AGAIN) {
        if (!held(&link->up) && link->state == LINK_WAITING)
            empty(&link->up);
        return false;
    }
    if (n <= 0) {
        link->eof = true;
        if (link->state <= LINK_HEAD)
            link_cut(link); /* nobody is there to be told */
        return false;
    }
    link->up.to += (uint32_t)n;
    if (link->state == LINK_WAITING)
        enter(link, LINK_HEAD);
    return true;
}

/* Judges what came. */
static bool vet(struct link *link)
{
    struct pen_error error = {0};
    char *data = link->up.data + link->up.from;
    if (link->state == LINK_HEAD) {
        int64_t n = framing_head(&link->framing, data, held(&link->up), &error);
        if (n == 0)
            return false;
        if (n > 0 && !open_inner(link))
            n = pen_fail(&error, PEN_UNAVAILABLE, "", "The service is out of descriptors.") - 1;
        if (n < 0) {
            link_refuse(link, &error);
            return true;
        }
        link->up.from += (uint32_t)link->framing.blank;
        link->vetted = (uint32_t)n - (uint32_t)link->framing.blank;
        framing_veil(link->up.data + link->up.from, link->vetted);
        link->received = 0;
        enter(link, link->framing.state == FRAMING_OVER ? LINK_ANSWER : LINK_BODY);
        return true;
    }
    uint32_t fresh = held(&link->up) - link->vetted;
    if (link->state != LINK_BODY || !fresh)
        return false;
    size_t kept;
    int64_t n = framing_body(&link->framing, data + link->vetted, fresh, &kept, &error);
    if (n < 0) {
        link_refuse(link, &error);
        return true;
    }
    uint32_t left_out = (uint32_t)((size_t)n - kept);
    link->vetted += (uint32_t)kept;
    if (left_out)
        memmove(data + link->vetted, data + link->vetted + left_out, fresh - (size_t)n);
    link->up.to -= left_out;
    link->received += (uint64_t)n;
    if (link->framing.state == FRAMING_OVER)
        enter(link, LINK_ANSWER);
    return true;
}

static bool write_inner(struct link *link)
{
    if (link->inner < 0)
        return false;
    if (link->deaf) {
        link->up.from += link->vetted;
        link->vetted = 0;
    }
    if (!link->vetted) {
        if (link->eof && !link->eof_told)
            shutdown(link->inner, SHUT_WR);
        link->eof_told = link->eof;
        return false;
    }
    int64_t n = result_of(send(
        link->inner, link->up.data + link->up.from, link->vetted, MSG_DONTWAIT | MSG_NOSIGNAL));
    if (n == AGAIN)
        return false;
    link->deaf = n < 0;
    if (n > 0) {
        link->up.from += (uint32_t)n;
        link->vetted -= (uint32_t)n;
    }
    return true;
}

/* Takes in what has come of the answer. The only one after which the request goes on, 100 Continue, is
 * passed on once: some versions of the library say it themselves behind what http.c has said. */
static void take_answer(struct link *link, uint32_t bytes)
{
    static const char text[] = HTTP_CONTINUE;
    const uint32_t length = sizeof text - 1;
    struct flow *down = &link->down;
    while (bytes >= length && !link->answered && !memcmp(down->data + down->to, text, length)) {
        bytes -= length;
        if (link->continued)
            memmove(down->data + down->to, down->data + down->to + length, bytes);
        else
            down->to += length;
        link->continued = true;
    }
    link->answered = link->answered || bytes;
    down->to += bytes;
}

static bool read_inner(struct link *link)
{
    if (link->inner < 0)
        return false;
    uint32_t notes = __atomic_load_n(&link->notes, __ATOMIC_ACQUIRE);
    uint32_t capacity = notes & LINK_STREAMS ? STREAM_BYTES : DOWN_BYTES;
    uint32_t room =
        held(&link->down) < capacity && !link->over ? make_room(&link->down, capacity) : 0;
    if (room) {
        int64_t n =
            result_of(recv(link->inner, link->down.data + link->down.to, room, MSG_DONTWAIT));
        if (n > 0) {
            take_answer(link, (uint32_t)n);
            return true;
        }
        link->over = n != AGAIN;
    }
    if (held(&link->down) || (!link->over && !(notes & LINK_DONE)))
        return false;
    if (link->over && !link->answered && !link->eof) {
        struct pen_error error = {0};
        pen_fail(&error, PEN_UNAVAILABLE, "", "The service could not take the request.");
        link_refuse(link, &error);
    } else {
        conclude(link, notes | (link->over ? LINK_CLOSES : 0));
    }
    return true;
}

static bool write_client(struct link *link)
{
    if (!held(&link->down)) {
        link->sending_ns = 0;
        if (link->state == LINK_ENDING)
            part(link);
        return false;
    }
    if (!link->sending_ns) {
        link->sending_ns = link->moved_ns = clock_now_ns();
        link->sent = 0;
    }
    if (__atomic_load_n(&link->notes, __ATOMIC_ACQUIRE) & LINK_STREAMS)
        limit_unsent(link, STREAM_UNSENT);
    int64_t n = client_write(link, link->down.data + link->down.from, held(&link->down));
    if (n == AGAIN)
        return false;
    if (n <= 0) {
        link_cut(link);
        return false;
    }
    link->down.from += (uint32_t)n;
    link->sent += (uint64_t)n;
    link->moved_ns = clock_now_ns();
    return true;
}

/* ---- events ---- */

static void listen_to(struct link *link, int fd, uint32_t *known, uint32_t events, int ear)
{
    struct epoll_event event = {.events = events, .data.ptr = &link->ears[ear]};
    if (*known == events)
        return;
    if (epoll_ctl(link->config->epoll, EPOLL_CTL_MOD, fd, &event))
        abort();
    *known = events;
}

static void listen_anew(struct link *link)
{
    bool writes = held(&link->down) || (link->tls && tls_wants_to_write(link->tls));
    bool reads = link->state == LINK_LINGERING ||
                 (wants_bytes(link) && !link->eof && held(&link->up) < UP_BYTES);
    /* Who hangs up while we are at work is noticed without reading what else was sent. */
    bool at_work = (link->state == LINK_ANSWER || link->state == LINK_BODY) && !link->eof;
    listen_to(link, link->client, &link->client_events,
        (reads ? EPOLLIN : 0u) | (writes ? EPOLLOUT : 0u) | (at_work ? EPOLLRDHUP : 0u), 0);
    if (link->inner >= 0)
        listen_to(link, link->inner, &link->inner_events,
            (held(&link->down) < DOWN_BYTES && !link->over ? EPOLLIN : 0u) |
                (link->vetted && !link->deaf ? EPOLLOUT : 0u),
            1);
}

void link_pump(struct link *link, uint32_t events)
{
    if (events & (EPOLLERR | EPOLLHUP) && link->state != LINK_DEAD)
        link_cut(link);
    if (events & EPOLLRDHUP && !wants_bytes(link))
        link->eof = true;
    bool moved = true;
    for (int round = 0; moved && (round < ROUNDS || link->tls) && link->state != LINK_DEAD;
         round++) {
        moved = read_client(link);
        moved = (link->state != LINK_DEAD && vet(link)) || moved;
        moved = (link->state != LINK_DEAD && write_inner(link)) || moved;
        moved = (link->state != LINK_DEAD && read_inner(link)) || moved;
        moved = (link->state != LINK_DEAD && write_client(link)) || moved;
    }
    link->unfinished = moved;
    if (link->state != LINK_DEAD)
        listen_anew(link);
}

struct link *link_create(const struct link_config *config, int client,
    const struct sockaddr_storage *from, struct tls *tls)
{
    struct link *link = pen_alloc_zero(1, sizeof *link);
    link->config = config;
    link->client = client;
    link->inner = link->far = -1;
    link->tls = tls;
    link->from = *from;
    for (int i = 0; i < 2; i++)
        link->ears[i] = (struct link_ear){link, i == 1};
    framing_init(&link->framing);
    enter(link, LINK_WAITING);
    limit_unsent(link, UNSENT);
    link->client_events = EPOLLIN;
    struct epoll_event event = {.events = EPOLLIN, .data.ptr = &link->ears[0]};
    if (epoll_ctl(config->epoll, EPOLL_CTL_ADD, client, &event))
        abort();
    return link;
}

void link_destroy(struct link *link)
{
    if (!link)
        return;
    link_cut(link);
    tls_destroy(link->tls);
    leave(link, link->client);
    empty(&link->up);
    empty(&link->down);
    free(link);
}

/* ---- patience ---- */

static bool is_under(uint64_t bytes, uint64_t age_ns, uint64_t rate)
{
    return (double)bytes < (double)age_ns / 1e9 * (double)rate;
}

void link_check(struct link *link, uint64_t now)
{
    const struct link_config *config = link->config;
    uint64_t age = now - link->since_ns, sending = link->sending_ns ? now - link->sending_ns : 0;
    struct pen_error late = {0};
    bool too_slow = false;
    enum link_state before = link->state;
    switch (link->state) {
    case LINK_WAITING:
        if (link->served && age > config->keep_alive_ms * CLOCK_MS)
            part(link);
        too_slow = !link->served && age > config->header_timeout_ms * CLOCK_MS;
        break;
    case LINK_HEAD:
        too_slow = age > config->header_timeout_ms * CLOCK_MS;
        break;
    case LINK_BODY: /* when there is room for more of it: else it is we who are slow */
        too_slow = held(&link->up) < UP_BYTES && age > BODY_GRACE_NS &&
                   is_under(link->received, age - BODY_GRACE_NS, config->body_rate);
        break;
    case LINK_ENDING:
        if (age > ENDING_NS)
            link_cut(link);
        break;
    case LINK_LINGERING:
        if (age > LINGER_NS)
            link_cut(link);
        break;
    default:
        break;
    }
    if (too_slow) {
        pen_fail(&late, PEN_TIMEOUT, "", "The request came too slowly.");
        link_refuse(link, &late);
    } else if (link->state < LINK_ENDING && sending > SEND_GRACE_NS &&
               is_under(link->sent, sending - SEND_GRACE_NS, SEND_RATE)) {
        pen_fail(&late, PEN_TIMEOUT, "", "The answer was read too slowly.");
        config->refused(config->context, link, &late, "-");
        link_cut(link);
    }
    if (link->state != LINK_DEAD && (link->unfinished || link->state != before))
        link_pump(link, 0);
}

uint64_t link_idleness(const struct link *link, uint64_t now)
{
    uint64_t age = now - link->since_ns, sending = link->sending_ns ? now - link->sending_ns : 0;
    if (link->state >= LINK_ENDING)
        return UINT64_MAX;
    if (link->state <= LINK_HEAD)
        return age + 1;
    if (link->state == LINK_BODY && held(&link->up) < UP_BYTES &&
        is_under(link->received, age, BRISK * link->config->body_rate))
        return age;
    /* What the kernel has taken of an answer the client has not read yet: who takes no more is slow. */
    return is_under(link->sent, sending, BRISK * SEND_RATE) ? sending
           : sending                                        ? now - link->moved_ns
                                                            : 0;
}
