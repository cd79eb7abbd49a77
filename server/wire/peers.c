#include "server/wire/peers.h"
#include "protocol/fnv.h"
#include "protocol/memory.h"
#include <stdlib.h>
#include <string.h>

static struct peer **find(struct peers *peers, const struct in6_addr *address)
{
    uint64_t hash = pen_fnv(PEN_FNV_START, address, sizeof *address);
    struct peer **at = &peers->lists[(hash ^ hash >> 32) & (PEER_LISTS - 1)];
    while (*at && memcmp(&(*at)->address, address, sizeof *address))
        at = &(*at)->next;
    return at;
}

struct peer *peers_enter(struct peers *peers, const struct in6_addr *address)
{
    struct peer **at = find(peers, address);
    if (!*at) {
        *at = pen_alloc_zero(1, sizeof **at);
        (*at)->address = *address;
        (*at)->after = peers->first;
        if (peers->first)
            peers->first->before = *at;
        peers->first = *at;
    }
    (*at)->count++;
    return *at;
}

void peers_leave(struct peers *peers, struct peer *peer)
{
    if (--peer->count)
        return;
    struct peer **at = find(peers, &peer->address);
    *at = peer->next;
    if (peer->before)
        peer->before->after = peer->after;
    else
        peers->first = peer->after;
    if (peer->after)
        peer->after->before = peer->before;
    free(peer);
}
