#include "server/http/http.h"
#include "protocol/memory.h"
#include "server/base/clock.h"
#include "server/base/request_id.h"
#include "server/base/status.h"
#include <arpa/inet.h>
#include <ctype.h>
#include <errno.h>
#include <microhttpd.h>
#include <netdb.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/random.h>
#include <sys/uio.h>
#include <unistd.h>

#define SWALLOW_BYTES (64u << 10) /* a refused body this small is read, to keep the connection */
#define CONNECTION_MEMORY (64u << 10)
#define LINGER_SPARE 64
#define STREAM_BLOCK (32u << 10)
#define STREAM_UNSENT (16 << 10) /* of a stream, what the kernel holds that is not on its way yet */

struct http_listener {
    struct http_config config;
    struct MHD_Daemon *daemon;
    struct door *door;
    uint32_t active; /* atomic */
    bool draining;   /* atomic */
};

/* Splits the raw request target; refuses what no route could mean. */
static bool check_target(struct http_exchange *x, struct pen_error *error)
{
    for (const char *scheme = "http://"; scheme; scheme = scheme[4] == ':' ? "https://" : NULL) {
        size_t n = strlen(scheme);
        if (!strncasecmp(x->path, scheme, n)) { /* the form that proxies use */
            static const char ends[] = {'/', FRAMING_QUERY, 0};
            size_t bytes = strcspn(x->path + n, ends);
            const char *rest = x->path + n + bytes;
            if (!bytes || bytes >= sizeof x->authority || memchr(x->path + n, '@', bytes))
                return pen_fail(error, PEN_MALFORMED, "", "The request target names no host.");
            memcpy(x->authority, x->path + n, bytes);
            bool is_path = *rest == '/';
            memmove(x->path + !is_path, rest, strlen(rest) + 1);
            *x->path = '/';
            break;
        }
    }
    bool is_all = !strcmp(x->path, "*") && !strcmp(x->method, "OPTIONS"); /* of the whole service */
    if (*x->path != '/' && !is_all)
        return pen_fail(error, PEN_MALFORMED, "", "The request target is not a path.");
    char *mark = strchr(x->path, FRAMING_QUERY);
    if (mark) {
        *mark = 0;
        x->query = mark + 1;
    }
    return true;
}

struct http_joined {
    struct http_joined *next;
    char *text;
    const char *name;
    uint32_t count;
};

static enum MHD_Result join(
    void *context, enum MHD_ValueKind kind, const char *name, const char *value)
{
    struct http_joined *joined = context;
    (void)kind;
    if (strcasecmp(name, joined->name) || !value)
        return MHD_YES;
    size_t before = joined->count++ ? strlen(joined->text) + 2 : 0, bytes = strlen(value) + 1;
    joined->text = pen_realloc_array(joined->text, before + bytes, 1);
    if (before)
        memcpy(joined->text + before - 2, ", ", 2);
    memcpy(joined->text + before, value, bytes);
    return MHD_YES;
}

const char *http_header(struct http_exchange *x, const char *name)
{
    const char *first = MHD_lookup_connection_value(x->connection, MHD_HEADER_KIND, name);
    struct http_joined all = {.name = name};
    if (!first)
        return NULL;
    for (const struct http_joined *j = x->joined; j; j = j->next)
        if (!strcasecmp(j->name, name))
            return j->text;
    MHD_get_connection_values(x->connection, MHD_HEADER_KIND, join, &all);
    if (all.count < 2) {
        free(all.text);
        return first;
    }
    struct http_joined *kept = pen_alloc(1, sizeof *kept);
    *kept = all;
    kept->next = x->joined;
    x->joined = kept;
    return kept->text;
}

const char *http_host(struct http_exchange *x)
{
    return *x->authority ? x->authority : http_header(x, "Host");
}

/* How long the body is; what the header says of it was judged before. False: there is none. */
static bool read_length(struct http_exchange *x)
{
    const char *length = http_header(x, "Content-Length");
    x->content_length = http_header(x, "Transfer-Encoding") ? HTTP_UNKNOWN_LENGTH
                        : length                            ? strtoull(length, NULL, 10)
                                                            : 0;
    return x->content_length != 0;
}

/* ---- answering ---- */

void http_add_header(struct http_exchange *x, const char *name, const char *format, ...)
{
    if (x->header_count == HTTP_MAX_HEADERS)
        return;
    struct http_header *header = &x->headers[x->header_count++];
    snprintf(header->name, sizeof header->name, "%s", name);
    va_list args;
    va_start(args, format);
    vsnprintf(header->value, sizeof header->value, format, args);
    va_end(args);
}

void http_answer(
    struct http_exchange *x, uint32_t status, const char *content_type, struct http_body body)
{
    if (content_type)
        http_add_header(x, "Content-Type", "%s", content_type);
    x->status = status;
    x->body = body;
    x->answered = true;
    if (x->deferred)
        MHD_resume_connection(x->connection); /* from here on the exchange may be gone */
}

void http_answer_stream(
    struct http_exchange *x, uint32_t status, const char *content_type, struct http_stream stream)
{
    x->stream = stream;
    http_answer(x, status, content_type,
        (struct http_body){.release = stream.release, .owner = stream.owner});
}

void http_answer_file(
    struct http_exchange *x, uint32_t status, const char *content_type, struct http_file file)
{
    x->file = file;
    http_answer(x, status, content_type, (struct http_body){.size = file.bytes});
}

void http_takes_place(const struct http_exchange *x)
{
    door_note(x->listener->door, x->fd, LINK_UPLOADS);
}

void http_sleep(struct http_exchange *x)
{
    MHD_suspend_connection(x->connection);
}

void http_wake(struct http_exchange *x)
{
    MHD_resume_connection(x->connection);
}

void http_defer(struct http_exchange *x)
{
    x->deferred = true;
    MHD_suspend_connection(x->connection);
}

bool http_client_is_gone(const struct http_exchange *x)
{
    struct pollfd watch = {x->fd, POLLRDHUP, 0};
    return poll(&watch, 1, 0) > 0 && (watch.revents & (POLLRDHUP | POLLHUP | POLLERR));
}

static void free_text(void *text)
{
    free(text);
}

struct http_body http_text(char *text)
{
    return (struct http_body){text, strlen(text), free_text, text};
}

struct http_body http_static(const void *data, size_t size)
{
    return (struct http_body){data, size, NULL, NULL};
}

static bool is_draining(const struct http_listener *listener)
{
    return __atomic_load_n(&listener->draining, __ATOMIC_ACQUIRE);
}

static ssize_t read_stream(void *context, uint64_t position, char *to, size_t most)
{
    struct http_exchange *x = context;
    (void)position;
    int64_t n = x->stream.read(x->stream.owner, to, most);
    if (n >= 0)
        x->body.size += (size_t)n;
    return n >= 0                  ? (ssize_t)n
           : n == HTTP_STREAM_OVER ? MHD_CONTENT_READER_END_OF_STREAM
                                   : MHD_CONTENT_READER_END_WITH_ERROR;
}

/* What a slow client has not read must not pile up on its way. */
static void limit_unsent(struct http_exchange *x)
{
    int bytes = STREAM_UNSENT;
    setsockopt(x->fd, SOL_SOCKET, SO_SNDBUF, &bytes, sizeof bytes);
    door_note(x->listener->door, x->fd, LINK_STREAMS);
}

static struct MHD_Response *make_response(struct http_exchange *x)
{
    if (x->file.fd > 0) {
        int fd = x->file.fd;
        x->file.fd = -1; /* the response's */
        struct MHD_Response *response =
            MHD_create_response_from_fd_at_offset64(x->file.bytes, fd, x->file.offset);
        if (!response)
            close(fd);
        return response;
    }
    if (!x->stream.read) /* released in completed() */
        return MHD_create_response_from_buffer(
            x->body.size, (void *)x->body.data, MHD_RESPMEM_PERSISTENT);
    limit_unsent(x);
    return MHD_create_response_from_callback(MHD_SIZE_UNKNOWN, STREAM_BLOCK, read_stream, x, NULL);
}

/* Hands the answer to libmicrohttpd. */
static enum MHD_Result queue(struct http_exchange *x)
{
    struct http_listener *listener = x->listener;
    struct MHD_Response *response = make_response(x);
    if (!response)
        return MHD_NO;
    bool complete = true;
    for (uint32_t i = 0; i < x->header_count; i++)
        complete = complete && MHD_add_response_header(
                                   response, x->headers[i].name, x->headers[i].value) == MHD_YES;
    if (x->closes || is_draining(listener)) {
        MHD_add_response_header(response, "Connection", "close");
        door_note(listener->door, x->fd, LINK_CLOSES);
    }
    x->queued = true;
    enum MHD_Result result =
        complete ? MHD_queue_response(x->connection, x->status, response) : MHD_NO;
    MHD_destroy_response(response);
    return result;
}

/* In the middle of a body libmicrohttpd takes no answer: it is written past it, and
 * the connection ends. */
static enum MHD_Result break_off(struct http_exchange *x)
{
    char head[4096];
    int n = snprintf(head, sizeof head,
        "HTTP/1.1 %u %s\r\nConnection: close\r\nContent-Length: %zu\r\n", x->status,
        http_status_title(x->status), x->body.size);
    for (uint32_t i = 0; i < x->header_count && n < (int)sizeof head - 700; i++)
        n += snprintf(head + n, sizeof head - (size_t)n, "%s: %s\r\n", x->headers[i].name,
            x->headers[i].value);
    n += snprintf(head + n, sizeof head - (size_t)n, "\r\n");
    struct iovec parts[] = {{head, (size_t)n}, {(void *)x->body.data, x->body.size}};
    struct msghdr message = {.msg_iov = parts, .msg_iovlen = 2};
    if (sendmsg(x->fd, &message, MSG_DONTWAIT | MSG_NOSIGNAL) < 0)
        x->aborted = true;
    x->queued = true;
    return MHD_NO;
}

/* ---- libmicrohttpd's callbacks ---- */

static void *on_target(void *context, const char *target, struct MHD_Connection *connection)
{
    struct http_listener *listener = context;
    struct http_exchange *x = pen_alloc_zero(1, sizeof *x);
    size_t bytes = strlen(target) + 1;
    x->path = memcpy(pen_alloc(bytes, 1), target, bytes);
    x->listener = listener;
    x->connection = connection;
    x->fd = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD)->connect_fd;
    return x;
}

/* A client that asks for it sends the body when it has heard that it is wanted. It is told so here:
 * versions of libmicrohttpd differ in when they do, and the door lets one pass. */
static void ask_for_body(struct http_exchange *x, const char *version)
{
    static const char text[] = HTTP_CONTINUE;
    const char *expected = http_header(x, "Expect");
    bool asks = expected && !strcasecmp(expected, "100-continue") && !strcmp(version, "HTTP/1.1");
    if (asks && send(x->fd, text, sizeof text - 1, MSG_DONTWAIT | MSG_NOSIGNAL) < 0)
        x->closes = true; /* the door has let go of it */
}

static enum MHD_Result begin(struct http_exchange *x, const char *method, const char *version)
{
    struct http_listener *listener = x->listener;
    const struct http_callbacks *callbacks = listener->config.callbacks;
    struct pen_error fault = {0};
    const struct sockaddr *address =
        MHD_get_connection_info(x->connection, MHD_CONNECTION_INFO_CLIENT_ADDRESS)->client_addr;
    x->begun = true;
    x->method = method;
    x->header_ns = x->body_ns = clock_now_ns();
    request_id_make(x->request_id);
    if (!address || getnameinfo(address,
                        address->sa_family == AF_INET6 ? sizeof(struct sockaddr_in6)
                                                       : sizeof(struct sockaddr_in),
                        x->client, sizeof x->client, NULL, 0, NI_NUMERICHOST))
        strcpy(x->client, "unknown");
    __atomic_add_fetch(&listener->active, 1, __ATOMIC_ACQ_REL);
    bool has_body = read_length(x);
    bool ok = check_target(x, &fault);
    x->closes = !ok;
    callbacks->begin(x, &fault);
    if (!x->answered && has_body)
        ask_for_body(x, version);
    if (!x->answered || !has_body)
        return x->answered && x->closes ? queue(x) : MHD_YES;
    /* Refused with a body to come. A small one is read first, so that the connection lives on. */
    if (ok && x->content_length <= SWALLOW_BYTES && !http_header(x, "Expect"))
        return MHD_YES;
    x->closes = true;
    return queue(x);
}

static enum MHD_Result on_request(void *context, struct MHD_Connection *connection, const char *url,
    const char *method, const char *version, const char *data, size_t *bytes, void **user)
{
    (void)context, (void)url, (void)connection;
    struct http_exchange *x = *user;
    const struct http_callbacks *callbacks = x->listener->config.callbacks;
    if (!x->begun)
        return begin(x, method, version);
    if (*bytes) {
        x->received += *bytes;
        if (!x->answered) {
            callbacks->body(x, data, *bytes);
            if (x->answered)
                return break_off(x);
        }
        *bytes = 0;
        return MHD_YES;
    }
    if (!x->body_done) {
        x->body_done = true;
        x->body_ns = clock_now_ns();
        if (!x->answered) {
            callbacks->end(x);
            if (x->deferred)
                return MHD_YES; /* another thread may be answering by now */
        }
    }
    return x->queued ? MHD_YES : queue(x);
}

static void on_completed(void *context, struct MHD_Connection *connection, void **user,
    enum MHD_RequestTerminationCode code)
{
    struct http_listener *listener = context;
    (void)connection;
    struct http_exchange *x = *user;
    if (!x)
        return;
    *user = NULL;
    if (x->begun) {
        x->aborted = x->aborted || code != MHD_REQUEST_TERMINATED_COMPLETED_OK;
        listener->config.callbacks->completed(x);
        if (x->answered && x->body.release)
            x->body.release(x->body.owner);
        if (x->file.fd > 0) /* nobody was left to send it to */
            close(x->file.fd);
    }
    door_note(listener->door, x->fd, LINK_DONE);
    if (x->begun)
        __atomic_sub_fetch(&listener->active, 1, __ATOMIC_ACQ_REL);
    while (x->joined) {
        struct http_joined *joined = x->joined;
        x->joined = joined->next;
        free(joined->text);
        free(joined);
    }
    free(x->path);
    free(x);
}

static void on_connection(void *context, struct MHD_Connection *connection, void **user,
    enum MHD_ConnectionNotificationCode code)
{
    struct http_listener *listener = context;
    (void)user;
    if (code == MHD_CONNECTION_NOTIFY_CLOSED)
        door_forget(listener->door,
            MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD)->connect_fd);
}

static void on_socket(void *context, int fd, const struct sockaddr *address, socklen_t bytes)
{
    struct http_listener *listener = context;
    if (MHD_add_connection(listener->daemon, fd, address, bytes) != MHD_YES)
        door_forget(listener->door, fd);
}

static void no_log(void *context, const char *format, va_list args)
{
    (void)context, (void)format, (void)args; /* its messages are about clients, not about us */
}

struct http_listener *http_listener_create(
    const struct http_config *config, struct pen_error *error)
{
    struct http_listener *listener = pen_alloc_zero(1, sizeof *listener);
    listener->config = *config;
    struct door_config *door = &listener->config.door;
    door->on_socket = on_socket;
    door->context = listener;
    /* libmicrohttpd's own limit is divided among its threads and silent: ours comes long before. */
    unsigned limit = (door->connections + LINGER_SPARE) * config->threads;
    unsigned flags = MHD_USE_EPOLL_INTERNAL_THREAD | MHD_USE_NO_LISTEN_SOCKET |
                     MHD_ALLOW_SUSPEND_RESUME | MHD_USE_ITC | MHD_USE_ERROR_LOG;
    struct MHD_OptionItem pool_options[] = {
        {MHD_OPTION_THREAD_POOL_SIZE, config->threads, NULL},
        {MHD_OPTION_END, 0, NULL},
    };
    struct MHD_OptionItem none[] = {{MHD_OPTION_END, 0, NULL}};
    listener->daemon = MHD_start_daemon(flags, 0, NULL, NULL, on_request, listener,
        MHD_OPTION_EXTERNAL_LOGGER, no_log, NULL, MHD_OPTION_URI_LOG_CALLBACK, on_target, listener,
        MHD_OPTION_NOTIFY_COMPLETED, on_completed, listener, MHD_OPTION_NOTIFY_CONNECTION,
        on_connection, listener, MHD_OPTION_CONNECTION_LIMIT, limit,
        MHD_OPTION_CONNECTION_MEMORY_LIMIT, (size_t)CONNECTION_MEMORY,
        MHD_OPTION_CONNECTION_TIMEOUT, 0u, MHD_OPTION_ARRAY,
        config->threads > 1 ? pool_options : none, MHD_OPTION_END);
    if (!listener->daemon) {
        pen_fail(error, PEN_UNAVAILABLE, "", "The HTTP listener cannot start.");
        tls_identity_destroy(door->tls);
        free(listener);
        return NULL;
    }
    listener->door = door_create(&listener->config.door, error);
    if (!listener->door) {
        MHD_stop_daemon(listener->daemon);
        free(listener);
        return NULL;
    }
    door_start(listener->door);
    return listener;
}

void *http_listener_context(const struct http_listener *listener)
{
    return listener->config.context;
}

struct door *http_listener_door(const struct http_listener *listener)
{
    return listener->door;
}

uint32_t http_listener_active(const struct http_listener *listener)
{
    struct door_numbers numbers;
    uint32_t active = __atomic_load_n(&listener->active, __ATOMIC_ACQUIRE);
    door_read(listener->door, &numbers);
    return active > numbers.engaged ? active : numbers.engaged;
}

void http_listener_drain(struct http_listener *listener)
{
    __atomic_store_n(&listener->draining, true, __ATOMIC_RELEASE);
    door_close(listener->door);
}

void http_listener_destroy(struct http_listener *listener)
{
    if (!listener)
        return;
    door_close_idle(listener->door);
    MHD_stop_daemon(listener->daemon);
    door_destroy(listener->door);
    free(listener);
}
