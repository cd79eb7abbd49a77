/* Whose connections there are: how many of each address, or network (address.h). */
#pragma once
#include <netinet/in.h>
#include <stdint.h>

#define PEER_LISTS 1024 /* a power of two */

struct peer {
    struct in6_addr address;
    uint32_t count;
    struct peer *next;
};
struct peers {
    struct peer *lists[PEER_LISTS];
};

/* One connection more of this address. */
struct peer *peers_enter(struct peers *peers, const struct in6_addr *address);
/* One less; without any the peer is freed. */
void peers_leave(struct peers *peers, struct peer *peer);
