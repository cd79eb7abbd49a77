#include "server/wire/address.h"
#include <errno.h>
#include <netdb.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#define NETWORK_BYTES 8 /* of an IPv6 address */

struct in6_addr address_network(const struct sockaddr_storage *from)
{
    struct in6_addr address = {0};
    if (from->ss_family == AF_INET6) {
        address = ((const struct sockaddr_in6 *)from)->sin6_addr;
        if (!IN6_IS_ADDR_V4MAPPED(&address) && !IN6_IS_ADDR_LOOPBACK(&address))
            memset(&address.s6_addr[NETWORK_BYTES], 0, sizeof address - NETWORK_BYTES);
    }
    if (from->ss_family == AF_INET) {
        address.s6_addr[10] = address.s6_addr[11] = 0xff;
        memcpy(&address.s6_addr[12], &((const struct sockaddr_in *)from)->sin_addr, 4);
    }
    return address;
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

int address_listen(const char *listen_on, int backlog, char *address, size_t address_bytes)
{
    char host[128], name[64], number[16];
    const char *port;
    struct addrinfo *list = NULL;
    struct addrinfo hints = {
        .ai_socktype = SOCK_STREAM, .ai_flags = AI_PASSIVE | AI_NUMERICHOST | AI_NUMERICSERV};
    errno = 0;
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
        bind(fd, list->ai_addr, list->ai_addrlen) || listen(fd, backlog) ||
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
