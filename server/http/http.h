/* HTTP listeners over libmicrohttpd; http.c is the only file that knows it. An exchange is one
 * request and its answer. Callbacks run on the listener's threads and must not block for long. */
#pragma once
#include "protocol/error.h"
#include "server/base/request_id.h"
#include "server/wire/door.h"

#define HTTP_MAX_HEADERS 16
#define HTTP_AUTHORITY_BYTES 264
#define HTTP_UNKNOWN_LENGTH UINT64_MAX

struct http_listener;

/* Bytes to send; `release(owner)` is called when they are no longer needed (NULL: static). */
struct http_body {
    const void *data;
    size_t size;
    void (*release)(void *owner);
    void *owner;
};

/* Bytes that come over time. */
#define HTTP_STREAM_OVER (-1)
#define HTTP_STREAM_BROKEN (-2) /* the client is to see that the answer is not complete */
struct http_stream {
    /* On a thread of the listener: puts at most `most` bytes at `to` and returns how many, or one of
     * the above. 0: there are none yet, and http_sleep has been called. Asked again when the
     * socket has taken what it gave; NULL: the answer is no stream. */
    int64_t (*read)(void *owner, void *to, size_t most);
    void (*release)(void *owner);
    void *owner;
};

/* A part of a file to send; `fd` is closed when it is sent. */
struct http_file {
    int fd;
    uint64_t offset, bytes;
};

struct http_header {
    char name[40], value[600];
};

struct http_exchange {
    struct http_listener *listener;
    const char *method;
    char *path;                           /* as sent, up to '?'; nothing decoded */
    char *query;                          /* as sent, behind '?', or NULL */
    char authority[HTTP_AUTHORITY_BYTES]; /* of a target that is a whole URI; or "" */
    char client[64];                      /* numeric address */
    char request_id[REQUEST_ID_BYTES];
    uint64_t content_length;     /* 0: no body, HTTP_UNKNOWN_LENGTH: chunked */
    uint64_t header_ns, body_ns; /* when the header and the body were complete */
    void *user;                  /* the owner's */
    /* The answer, for the log: */
    uint32_t status;
    struct http_body body; /* of a stream, its size is what was sent so far */
    struct http_stream stream;
    struct http_file file; /* fd 0: none */
    bool aborted;          /* the client did not get all of the answer */
    /* http.c's own: */
    struct http_header headers[HTTP_MAX_HEADERS];
    uint32_t header_count;
    void *connection;
    int fd;
    bool begun, answered, deferred, queued, closes, body_done;
    uint64_t received;
    struct http_joined *joined;
};

struct http_callbacks {
    /* The header is complete. `fault` is filled when the request must be refused and the connection
     * closed: then it must be answered here. Otherwise it may be answered here. */
    void (*begin)(struct http_exchange *exchange, const struct pen_error *fault);
    /* A piece of the body; answering here ends the request. */
    void (*body)(struct http_exchange *exchange, const void *data, size_t bytes);
    /* The body is complete: must answer or defer. */
    void (*end)(struct http_exchange *exchange);
    /* The answer was sent or the client lost; the exchange is freed after this. Called once for
     * every exchange that had `begin`. */
    void (*completed)(struct http_exchange *exchange);
};

struct http_config {
    struct door_config door; /* on_socket and context are filled in */
    const struct http_callbacks *callbacks;
    void *context;
    uint32_t threads;
};

struct http_listener *http_listener_create(
    const struct http_config *config, struct pen_error *error);
void *http_listener_context(const struct http_listener *listener);
struct door *http_listener_door(const struct http_listener *listener);
/* Requests that are not answered to the last byte. */
uint32_t http_listener_active(const struct http_listener *listener);
/* Accepts no new connection; every answer from now on closes its connection. */
void http_listener_drain(struct http_listener *listener);
/* Nothing may be deferred any more. */
void http_listener_destroy(struct http_listener *listener);

/* The body takes up a place: while more of them come than the door has for that (door_config.uploads),
 * those that come slowly are ended. */
void http_takes_place(const struct http_exchange *exchange);

/* A header of the request, or NULL; of several the values with commas (RFC 9110, 5.3). Not by two threads
 * at a time. */
const char *http_header(struct http_exchange *exchange, const char *name);
/* What the client calls this service: of the target, when it says that, or Host; NULL: nothing. */
const char *http_host(struct http_exchange *exchange);
/* Adds a header to the answer, before http_answer. */
void http_add_header(struct http_exchange *exchange, const char *name, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
/* Answers; content_type may be NULL when there is no body. Within a callback, or from any thread
 * once after http_defer. Takes the body. */
void http_answer(struct http_exchange *exchange, uint32_t status, const char *content_type,
    struct http_body body);
/* Answers with a stream, in the same way; nothing is sent of it when only the header is asked for. */
void http_answer_stream(struct http_exchange *exchange, uint32_t status, const char *content_type,
    struct http_stream stream);
/* Answers with a part of a file, in the same way. Takes the descriptor. */
void http_answer_file(struct http_exchange *exchange, uint32_t status, const char *content_type,
    struct http_file file);
/* Inside `read`, which then returns 0, and before another thread can wake it: the stream has nothing
 * more until http_wake, from any thread, once. */
void http_sleep(struct http_exchange *exchange);
void http_wake(struct http_exchange *exchange);
/* The answer comes later, from http_answer. Only inside `end`, and before the work is handed to
 * another thread; the exchange must not be touched afterwards by the caller. */
void http_defer(struct http_exchange *exchange);
/* The client has hung up. Any thread, while deferred. */
bool http_client_is_gone(const struct http_exchange *exchange);

/* A body that is malloc'd text. */
struct http_body http_text(char *text);
struct http_body http_static(const void *data, size_t size);
