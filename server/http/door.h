/* The listening socket and what guards it: accepts, counts, refuses above the limits with an answer
 * of its own, and shuts down connections that are too slow. Knows nothing of HTTP parsing. */
#pragma once
#include "protocol/error.h"
#include <netinet/in.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/socket.h>

struct door_config {
    const char *listen; /* "127.0.0.1:8080", "[::1]:0" */
    uint32_t connections, connections_per_address;
    uint64_t header_timeout_ms, keep_alive_ms;
    uint64_t body_rate; /* bytes per second */
    bool plain;         /* no TLS: refusals may be written to the socket */
    /* Takes over an accepted socket, closing it whatever happens. */
    void (*on_socket)(void *context, int fd, const struct sockaddr *address, socklen_t bytes);
    void *context;
};

/* What a connection is doing, as far as patience is concerned. */
enum door_state {
    DOOR_WAITING, /* for the first byte of a request */
    DOOR_HEADER,
    DOOR_BODY,
    DOOR_BUSY, /* we are at work: no limit here */
    DOOR_SENDING,
};

struct door;
/* Binds. Errors: PEN_UNAVAILABLE. */
struct door *door_create(const struct door_config *config, struct pen_error *error);
/* Starts accepting. */
void door_start(struct door *door);
/* The address it listens on, "127.0.0.1:34567". */
const char *door_address(const struct door *door);

/* The connection behind `fd` enters a state; `bytes` is what DOOR_SENDING has to send. */
void door_set(struct door *door, int fd, enum door_state state, uint64_t bytes);
/* Body bytes arrived. */
void door_received(struct door *door, int fd, uint64_t bytes);
/* The connection closes with unread input: what still comes is to be read and thrown away for a
 * while, or the kernel would reset the connection and the client lose the answer. */
void door_linger(struct door *door, int fd);
/* The connection is about to be closed by its owner. */
void door_forget(struct door *door, int fd);

/* Accepts what is already queued, then closes the listening socket. */
void door_close(struct door *door);
/* Shuts down every connection that waits for a request. */
void door_close_idle(struct door *door);
void door_destroy(struct door *door);

struct door_numbers {
    uint32_t open;
    uint64_t accepted, refused, too_slow;
};
void door_read(struct door *door, struct door_numbers *numbers);
