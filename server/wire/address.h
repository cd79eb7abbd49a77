/* Addresses to listen on, and whose a connection is. */
#pragma once
#include "protocol/error.h"
#include <netinet/in.h>
#include <stddef.h>
#include <sys/socket.h>

/* A socket that listens on "127.0.0.1:8080" or "[::1]:0" and does not block; `address` is filled with
 * what it has become, "127.0.0.1:34567". -1: errno says why not, 0: it is no address and port. */
int address_listen(const char *listen_on, int backlog, char *address, size_t address_bytes);
/* Whom to count a connection to: an IPv4 address, mapped, or the network of an IPv6 address, which
 * one client has all of. */
struct in6_addr address_network(const struct sockaddr_storage *from);
