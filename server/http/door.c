#include "server/http/door.h"
#include "protocol/memory.h"
#include "server/http/status.h"
#include "server/base/clock.h"
#include "server/base/log.h"
#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

#define TICK_MS 200
#define BODY_GRACE_NS (5 * CLOCK_S)
#define SEND_GRACE_NS (30 * CLOCK_S)
#define SEND_RATE (16u << 10) /* bytes per second a client must read at least */
#define LINGERING 64
#define LINGER_NS (2 * CLOCK_S)
#define LINGER_BYTES (64u << 20)
#define BACKLOG 512

struct entry {
    bool used, linger, served, shut;
    enum door_state state;
    uint64_t since_ns, bytes;
    struct in6_addr address;
};

struct lingerer {
    int fd;
    uint64_t until_ns, bytes;
};

struct door {
    struct door_config config;
    char address[128];
    int listen_fd; /* the thread's; -1 once closed */
    int wake;
    pthread_t thread;
    bool started;
    pthread_mutex_t lock; /* guards everything below; held over shutdown(), dup() and send() only */
    pthread_cond_t closed_changed;
    struct entry *entries; /* by descriptor */
    int capacity;
    struct door_numbers numbers;
    struct lingerer lingering[LINGERING];
    uint32_t lingering_count;
    bool closing, closed, stopping;
};

static void wake(struct door *door)
{
    uint64_t one = 1;
    if (write(door->wake, &one, sizeof one) < 0 && errno != EAGAIN)
        abort();
}

static struct in6_addr address_of(const struct sockaddr_storage *from)
{
    struct in6_addr address = {0};
    if (from->ss_family == AF_INET6)
        return ((const struct sockaddr_in6 *)from)->sin6_addr;
    if (from->ss_family == AF_INET) {
        address.s6_addr[10] = address.s6_addr[11] = 0xff;
        memcpy(&address.s6_addr[12], &((const struct sockaddr_in *)from)->sin_addr, 4);
    }
    return address;
}

/* Under the lock. Anything but PEN_OK: the table is full for this door's limits. */
static enum pen_code admit(struct door *door, int fd, const struct sockaddr_storage *from)
{
    struct in6_addr address = address_of(from);
    uint32_t same = 0;
    for (int i = 0; i < door->capacity; i++)
        same +=
            door->entries[i].used && !memcmp(&door->entries[i].address, &address, sizeof address);
    if (door->numbers.open >= door->config.connections)
        return PEN_UNAVAILABLE;
    if (same >= door->config.connections_per_address)
        return PEN_TOO_MANY;
    if (fd >= door->capacity) {
        int capacity = fd * 2 + 64;
        door->entries = pen_realloc_array(door->entries, (size_t)capacity, sizeof *door->entries);
        memset(door->entries + door->capacity, 0,
            (size_t)(capacity - door->capacity) * sizeof *door->entries);
        door->capacity = capacity;
    }
    door->numbers.open -= door->entries[fd].used; /* its owner closed it without a word */
    door->entries[fd] = (struct entry){
        .used = true, .state = DOOR_WAITING, .since_ns = clock_now_ns(), .address = address};
    door->numbers.open++;
    door->numbers.accepted++;
    return PEN_OK;
}

/* A short answer written past the HTTP library; what does not fit the socket's buffer is lost. */
static void write_refusal(int fd, enum pen_code code, const char *detail)
{
    struct http_status told = http_status_of(code);
    struct pen_error error = {0};
    char text[640];
    pen_fail(&error, code, "", "%s", detail);
    char *body = http_problem(&error, NULL);
    int size = snprintf(text, sizeof text,
        "HTTP/1.1 %u %s\r\nContent-Type: application/problem+json\r\nContent-Length: %zu\r\n"
        "Retry-After: 1\r\nConnection: close\r\n\r\n%s",
        told.status, told.title, strlen(body), body);
    free(body);
    if (send(fd, text, (size_t)size, MSG_DONTWAIT | MSG_NOSIGNAL) < 0)
        return;
}

/* Under the lock. Keeps `fd`, or closes it when there are too many already. */
static void add_lingerer(struct door *door, int fd)
{
    if (door->lingering_count == LINGERING) {
        close(fd);
        return;
    }
    door->lingering[door->lingering_count++] = (struct lingerer){fd, clock_now_ns() + LINGER_NS, 0};
}

/* Accepts everything that is queued. */
static void accept_all(struct door *door)
{
    for (;;) {
        struct sockaddr_storage from;
        socklen_t bytes = sizeof from;
        int fd = accept4(
            door->listen_fd, (struct sockaddr *)&from, &bytes, SOCK_CLOEXEC | SOCK_NONBLOCK);
        if (fd < 0) {
            if (errno == EMFILE || errno == ENFILE || errno == ENOMEM || errno == ENOBUFS)
                usleep(20000); /* the queue keeps them; trying at once would spin */
            if (errno == EINTR || errno == ECONNABORTED)
                continue;
            return;
        }
        int one = 1;
        setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
        pthread_mutex_lock(&door->lock);
        enum pen_code refusal = admit(door, fd, &from);
        if (refusal != PEN_OK) {
            door->numbers.refused++;
            if (door->config.plain)
                write_refusal(fd, refusal, "There are too many connections.");
            shutdown(fd, SHUT_WR);
            add_lingerer(door, fd);
        }
        pthread_mutex_unlock(&door->lock);
        if (refusal == PEN_OK)
            door->config.on_socket(door->config.context, fd, (struct sockaddr *)&from, bytes);
    }
}

static bool is_too_slow(const struct door *door, const struct entry *entry, uint64_t now)
{
    const struct door_config *config = &door->config;
    uint64_t age = now - entry->since_ns;
    switch (entry->state) {
    case DOOR_WAITING:
        return age > (entry->served ? config->keep_alive_ms : config->header_timeout_ms) * CLOCK_MS;
    case DOOR_HEADER:
        return age > config->header_timeout_ms * CLOCK_MS;
    case DOOR_BODY:
        return age > BODY_GRACE_NS && (double)entry->bytes < (double)(age - BODY_GRACE_NS) / 1e9 *
                                                                 (double)config->body_rate;
    case DOOR_SENDING:
        return age > SEND_GRACE_NS + entry->bytes / SEND_RATE * CLOCK_S;
    default:
        return false;
    }
}

static void reap(struct door *door)
{
    pthread_mutex_lock(&door->lock);
    uint64_t now = clock_now_ns(); /* under the lock: never before an entry's time */
    for (int fd = 0; fd < door->capacity; fd++) {
        struct entry *entry = &door->entries[fd];
        if (!entry->used || entry->shut || !is_too_slow(door, entry, now))
            continue;
        bool asked = entry->state == DOOR_HEADER || entry->state == DOOR_BODY ||
                     (entry->state == DOOR_WAITING && !entry->served);
        if (asked && door->config.plain)
            write_refusal(fd, PEN_TIMEOUT, "The request came too slowly.");
        door->numbers.too_slow += asked || entry->state == DOOR_SENDING;
        entry->shut = true;
        shutdown(fd, SHUT_RDWR);
    }
    pthread_mutex_unlock(&door->lock);
}

/* Reads and throws away; true when the descriptor can be closed. */
static bool swallow(struct lingerer *lingerer, uint64_t now)
{
    char scrap[65536];
    for (;;) {
        ssize_t n = recv(lingerer->fd, scrap, sizeof scrap, MSG_DONTWAIT);
        if (n < 0)
            return errno != EAGAIN || now > lingerer->until_ns;
        lingerer->bytes += (uint64_t)n;
        if (n == 0 || lingerer->bytes > LINGER_BYTES || now > lingerer->until_ns)
            return true;
    }
}

static void *run(void *argument)
{
    struct door *door = argument;
    uint64_t last_reap = 0, ignored;
    bool stopping = false;
    while (!stopping) {
        struct pollfd watch[2 + LINGERING];
        struct lingerer copies[LINGERING];
        pthread_mutex_lock(&door->lock);
        uint32_t lingering = door->lingering_count;
        memcpy(copies, door->lingering, lingering * sizeof *copies);
        pthread_mutex_unlock(&door->lock);
        watch[0] = (struct pollfd){door->listen_fd, POLLIN, 0};
        watch[1] = (struct pollfd){door->wake, POLLIN, 0};
        for (uint32_t i = 0; i < lingering; i++)
            watch[2 + i] = (struct pollfd){copies[i].fd, POLLIN, 0};
        poll(watch, 2 + lingering, TICK_MS);
        if (watch[1].revents && read(door->wake, &ignored, sizeof ignored) < 0 && errno != EAGAIN)
            abort();
        if (watch[0].revents)
            accept_all(door);
        uint64_t now = clock_now_ns();
        if (now - last_reap > TICK_MS * CLOCK_MS) {
            reap(door);
            last_reap = now;
        }
        for (uint32_t i = lingering; i-- > 0;) {
            /* Only this thread removes lingerers, so that places do not move meanwhile. */
            bool over = swallow(&copies[i], now);
            pthread_mutex_lock(&door->lock);
            door->lingering[i] = copies[i];
            if (over) {
                close(copies[i].fd);
                door->lingering[i] = door->lingering[--door->lingering_count];
            }
            pthread_mutex_unlock(&door->lock);
        }
        pthread_mutex_lock(&door->lock);
        bool close_now = door->closing && !door->closed;
        stopping = door->stopping;
        pthread_mutex_unlock(&door->lock);
        if (close_now) {
            accept_all(door);
            close(door->listen_fd);
            door->listen_fd = -1;
            pthread_mutex_lock(&door->lock);
            door->closed = true;
            pthread_cond_broadcast(&door->closed_changed);
            pthread_mutex_unlock(&door->lock);
        }
    }
    return NULL;
}

/* Splits "host:port" or "[host]:port". */
static bool split(const char *listen_on, char *host, size_t host_bytes, const char **port)
{
    const char *colon = strrchr(listen_on, ':');
    if (!colon || colon == listen_on)
        return false;
    const char *from = listen_on;
    size_t length = (size_t)(colon - from);
    if (*from == '[' && length > 2 && from[length - 1] == ']')
        from++, length -= 2;
    if (length >= host_bytes)
        return false;
    memcpy(host, from, length);
    host[length] = 0;
    *port = colon + 1;
    return true;
}

static int bind_to(const char *listen_on, char *address, size_t address_bytes)
{
    char host[128], name[64], number[16];
    const char *port;
    struct addrinfo *list = NULL;
    struct addrinfo hints = {
        .ai_socktype = SOCK_STREAM, .ai_flags = AI_PASSIVE | AI_NUMERICHOST | AI_NUMERICSERV};
    if (!split(listen_on, host, sizeof host, &port))
        return -1;
    if (!strcmp(host, "localhost"))
        strcpy(host, "127.0.0.1");
    if (getaddrinfo(host, port, &hints, &list))
        return -1;
    int fd = socket(list->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    int one = 1;
    struct sockaddr_storage bound;
    socklen_t bytes = sizeof bound;
    if (fd < 0 || setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &one, sizeof one) ||
        bind(fd, list->ai_addr, list->ai_addrlen) || listen(fd, BACKLOG) ||
        getsockname(fd, (struct sockaddr *)&bound, &bytes) ||
        getnameinfo((struct sockaddr *)&bound, bytes, name, sizeof name, number, sizeof number,
            NI_NUMERICHOST | NI_NUMERICSERV)) {
        if (fd >= 0)
            close(fd);
        fd = -1;
    } else {
        snprintf(address, address_bytes, bound.ss_family == AF_INET6 ? "[%s]:%s" : "%s:%s", name,
            number);
    }
    freeaddrinfo(list);
    return fd;
}

struct door *door_create(const struct door_config *config, struct pen_error *error)
{
    struct door *door = pen_alloc_zero(1, sizeof *door);
    door->config = *config;
    door->listen_fd = bind_to(config->listen, door->address, sizeof door->address);
    if (door->listen_fd < 0) {
        pen_fail(error, PEN_UNAVAILABLE, "", "Cannot listen on %.100s: %s.", config->listen,
            errno ? strerror(errno) : "not an address and a port");
        free(door);
        return NULL;
    }
    pthread_mutex_init(&door->lock, NULL);
    pthread_cond_init(&door->closed_changed, NULL);
    door->wake = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (door->wake < 0)
        abort();
    return door;
}

void door_start(struct door *door)
{
    if (pthread_create(&door->thread, NULL, run, door))
        abort();
    door->started = true;
}

const char *door_address(const struct door *door)
{
    return door->address;
}

void door_set(struct door *door, int fd, enum door_state state, uint64_t bytes)
{
    pthread_mutex_lock(&door->lock);
    struct entry *entry = &door->entries[fd];
    entry->state = state;
    entry->bytes = bytes;
    entry->since_ns = clock_now_ns();
    entry->served = entry->served || state == DOOR_SENDING;
    pthread_mutex_unlock(&door->lock);
}

void door_received(struct door *door, int fd, uint64_t bytes)
{
    pthread_mutex_lock(&door->lock);
    door->entries[fd].bytes += bytes;
    pthread_mutex_unlock(&door->lock);
}

void door_linger(struct door *door, int fd)
{
    pthread_mutex_lock(&door->lock);
    door->entries[fd].linger = true;
    pthread_mutex_unlock(&door->lock);
}

void door_forget(struct door *door, int fd)
{
    pthread_mutex_lock(&door->lock);
    struct entry *entry = &door->entries[fd];
    bool linger = entry->linger && !entry->shut;
    entry->used = false;
    door->numbers.open--;
    if (linger) {
        int copy = fcntl(fd, F_DUPFD_CLOEXEC, 0);
        shutdown(fd, SHUT_WR);
        if (copy >= 0)
            add_lingerer(door, copy);
    }
    pthread_mutex_unlock(&door->lock);
    if (linger)
        wake(door);
}

void door_close(struct door *door)
{
    pthread_mutex_lock(&door->lock);
    door->closing = true;
    pthread_mutex_unlock(&door->lock);
    wake(door);
    pthread_mutex_lock(&door->lock);
    while (!door->closed)
        pthread_cond_wait(&door->closed_changed, &door->lock);
    pthread_mutex_unlock(&door->lock);
}

void door_close_idle(struct door *door)
{
    pthread_mutex_lock(&door->lock);
    for (int fd = 0; fd < door->capacity; fd++) {
        struct entry *entry = &door->entries[fd];
        if (!entry->used || entry->shut || entry->state != DOOR_WAITING)
            continue;
        entry->shut = true;
        shutdown(fd, SHUT_RDWR);
    }
    pthread_mutex_unlock(&door->lock);
}

void door_destroy(struct door *door)
{
    if (!door)
        return;
    pthread_mutex_lock(&door->lock);
    door->stopping = true;
    pthread_mutex_unlock(&door->lock);
    wake(door);
    if (door->started)
        pthread_join(door->thread, NULL);
    if (door->listen_fd >= 0)
        close(door->listen_fd);
    for (uint32_t i = 0; i < door->lingering_count; i++)
        close(door->lingering[i].fd);
    close(door->wake);
    pthread_mutex_destroy(&door->lock);
    pthread_cond_destroy(&door->closed_changed);
    free(door->entries);
    free(door);
}

void door_read(struct door *door, struct door_numbers *numbers)
{
    pthread_mutex_lock(&door->lock);
    *numbers = door->numbers;
    pthread_mutex_unlock(&door->lock);
}
