/* The listening socket and what guards it: accepts, counts, and where places are short has who is
 * slowest leave, so that nobody who is quick is turned away for their sake. What requests look like is
 * judged on the way (framing.h); what they mean nobody here knows. */
#pragma once
#include "protocol/error.h"
#include "server/wire/link.h"
#include <stddef.h>
#include <stdint.h>
#include <sys/socket.h>

struct door_config {
    const char *name;   /* for the log */
    const char *listen; /* "127.0.0.1:8080", "[::1]:0" */
    uint32_t connections, connections_per_address;
    uint32_t uploads; /* bodies that take up a place; beyond it the slowest leave */
    uint64_t header_timeout_ms, keep_alive_ms;
    uint64_t body_rate; /* bytes per second */
    uint32_t
        spares; /* descriptors of its own for when the process has no more, 0 to DOOR_MAX_SPARES */
    uint32_t margin;          /* descriptors below the process's limit that are left to others */
    struct tls_identity *tls; /* NULL: none. The door's from here on */
    /* Takes over the socket of a request, closing it whatever happens. */
    void (*on_socket)(void *context, int fd, const struct sockaddr *address, socklen_t bytes);
    void *context;
};

struct door;
/* Binds. Errors: PEN_UNAVAILABLE. */
struct door *door_create(const struct door_config *config, struct pen_error *error);
/* Starts accepting. */
void door_start(struct door *door);
/* The address it listens on, "127.0.0.1:34567". */
const char *door_address(const struct door *door);
/* Another certificate, for connections from now on; takes it. */
void door_set_tls(struct door *door, struct tls_identity *tls);

/* Any thread: what the owner of a socket that on_socket took says of its request, enum link_note. */
void door_note(struct door *door, int fd, uint32_t notes);
/* The socket is about to be closed by its owner. */
void door_forget(struct door *door, int fd);

/* Accepts what is already queued, then closes the listening socket. */
void door_close(struct door *door);
/* Ends every connection that waits for a request. */
void door_close_idle(struct door *door);
void door_destroy(struct door *door);

struct door_numbers {
    uint32_t open, engaged; /* connections; those with a request, to its last byte sent */
    uint64_t accepted, refused, too_slow, displaced, malformed;
};
void door_read(struct door *door, struct door_numbers *numbers);
