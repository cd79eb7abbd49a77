/* A client's connection, and how its bytes go to the HTTP library and back: the header of a request is
 * read and judged here, and only when it is whole does the library get a socket of its own, the far
 * end of a pair, for as long as the request lasts. Who only waits costs one descriptor. All on the
 * door's thread, but for link_note. */
#pragma once
#include "server/wire/framing.h"
#include "server/wire/tls.h"
#include <sys/socket.h>

struct link;

struct link_config {
    int epoll; /* the data of its events is a struct link_ear */
    uint64_t header_timeout_ms, keep_alive_ms;
    uint64_t body_rate; /* bytes per second that a client must send at least */
    /* Gives the far end of a pair away, closed whatever happens. */
    void (*open)(void *context, struct link *link, int far);
    /* What the far end's owner says is of no concern to the link any more. */
    void (*detach)(void *context, struct link *link, int far);
    /* Gives back descriptors that were kept for the worst. */
    void (*relieve)(void *context);
    /* A request was refused, or a client found too slow. */
    void (*refused)(void *context, const struct link *link, const struct pen_error *error,
        const char *request_id);
    void *context;
    int highest; /* descriptor that a request may have */
};

#define HTTP_CONTINUE "HTTP/1.1 100 Continue\r\n\r\n"

/* One of a link's two sockets. */
struct link_ear {
    struct link *link;
    bool inner;
};

enum link_state {
    LINK_WAITING, /* for the first byte of a request */
    LINK_HEAD,
    LINK_BODY,
    LINK_ANSWER,    /* the whole request has come */
    LINK_ENDING,    /* the last bytes are on their way out */
    LINK_LINGERING, /* what still comes is thrown away for a while, or the kernel would reset the
                       connection and the client lose the answer */
    LINK_DEAD,
};

/* What the far end's owner says: flags. */
enum link_note {
    LINK_DONE = 1,    /* the answer has been written */
    LINK_CLOSES = 2,  /* and is the last one */
    LINK_STREAMS = 4, /* what the client has not read must not pile up here */
    LINK_UPLOADS = 8, /* the body takes up a place that others may need */
};

struct flow { /* bytes on their way */
    char *data;
    uint32_t from, to, capacity;
};

struct link {
    const struct link_config *config;
    struct link_ear ears[2]; /* the client's and the inner one's */
    int client, inner, far;  /* descriptors; -1 */
    struct tls *tls;
    struct sockaddr_storage from;
    enum link_state state;
    struct framing framing;
    struct flow up, down;
    uint32_t vetted; /* bytes at the beginning of `up` that may go to the library */
    uint32_t client_events, inner_events;
    uint64_t since_ns, received; /* of the state, and of the body */
    uint64_t sending_ns, sent;   /* since when bytes wait for the client; 0: none do */
    uint64_t moved_ns;           /* when the last of them went */
    bool served, answered, continued, eof, eof_told, deaf, over;
    bool unfinished; /* there was more to move than a turn allows */
    uint32_t notes;  /* atomic: enum link_note */
    /* The door's. */
    struct peer *peer;
    struct link *before, *after; /* of the peer's */
    struct link *next_noted, *next_buried;
    bool noted, buried, live;
    uint32_t place;
};

/* Takes the client's socket. */
struct link *link_create(const struct link_config *config, int client,
    const struct sockaddr_storage *from, struct tls *tls);
void link_destroy(struct link *link);
/* Moves what can be moved. `events` are epoll's, of the client's socket. */
void link_pump(struct link *link, uint32_t events);
/* Ends it now; nothing more is sent. */
void link_cut(struct link *link);
/* Answers with a problem document, where that is still possible, and closes. */
void link_refuse(struct link *link, const struct pen_error *error);
/* Has patience with the client, or not. */
void link_check(struct link *link, uint64_t now);
/* How long a client has kept its place for little, in nanoseconds; 0: it has not. Who waits for us
 * has not, nor who sends and reads well. */
uint64_t link_idleness(const struct link *link, uint64_t now);
