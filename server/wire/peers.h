/* Whose connections there are: those of each address, or network (address.h). */
#pragma once
#include <netinet/in.h>
#include <stdint.h>

#define PEER_LISTS 1024 /* a power of two */

struct link;

struct peer {
    struct in6_addr address;
    uint32_t count;              /* connections */
    uint32_t live;               /* of these, not on their way out */
    struct link *links;          /* the door's list of them */
    struct peer *next;           /* of its hash */
    struct peer *before, *after; /* of all */
};
struct peers {
    struct peer *lists[PEER_LISTS];
    struct peer *first; /* of all */
};

/* One connection more of this address. */
struct peer *peers_enter(struct peers *peers, const struct in6_addr *address);
/* One less; without any the peer is freed. */
void peers_leave(struct peers *peers, struct peer *peer);
