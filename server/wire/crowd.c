#include "server/wire/crowd.h"
#include "protocol/memory.h"
#include <stdlib.h>

void crowd_enter(struct crowd *crowd, struct link *link, struct peer *peer)
{
    link->place = crowd->count;
    crowd->links = pen_grow(crowd->links, &crowd->capacity, crowd->count + 1, sizeof *crowd->links);
    crowd->links[crowd->count++] = link;
    link->peer = peer;
    link->after = peer->links;
    if (peer->links)
        peer->links->before = link;
    peer->links = link;
    crowd_look(crowd, link);
}

void crowd_leave(struct crowd *crowd, struct link *link)
{
    struct link *last = crowd->links[--crowd->count];
    crowd->links[link->place] = last;
    last->place = link->place;
    crowd_look(crowd, link);
    if (link->before)
        link->before->after = link->after;
    else
        link->peer->links = link->after;
    if (link->after)
        link->after->before = link->before;
    peers_leave(&crowd->peers, link->peer);
}

void crowd_look(struct crowd *crowd, struct link *link)
{
    bool live = !link->buried && link->state < LINK_ENDING;
    if (live == link->live)
        return;
    link->live = live;
    crowd->live += live ? 1 : -1u;
    link->peer->live += live ? 1 : -1u;
}

void crowd_finish(struct crowd *crowd)
{
    free(crowd->links);
}

static bool is_wanted(const struct link *link, const struct crowd_wanted *wanted)
{
    bool uploads =
        link->state == LINK_BODY && __atomic_load_n(&link->notes, __ATOMIC_ACQUIRE) & LINK_UPLOADS;
    return link->live && (!wanted->uploads || uploads);
}

/* Of one address. */
static struct link *find_idlest_of(
    const struct peer *peer, const struct crowd_wanted *wanted, uint64_t now_ns)
{
    uint64_t longest = wanted->uploads ? CROWD_FRESH_NS : 0;
    struct link *found = NULL;
    for (struct link *link = peer->links; link; link = link->after) {
        uint64_t idle = is_wanted(link, wanted) ? link_idleness(link, now_ns) : 0;
        if (idle <= longest)
            continue;
        found = link;
        longest = idle;
    }
    return found;
}

struct link *crowd_find_idlest(
    const struct crowd *crowd, const struct crowd_wanted *wanted, uint64_t now_ns)
{
    for (uint32_t i = 0; wanted->dying && crowd->count > crowd->live && i < crowd->count; i++)
        if (!crowd->links[i]->live)
            return crowd->links[i];
    if (wanted->peer)
        return find_idlest_of(wanted->peer, wanted, now_ns);
    struct link *found = NULL;
    for (const struct peer *peer = crowd->peers.first; peer; peer = peer->after) {
        bool more = peer->live && (!found || peer->live > found->peer->live);
        struct link *link = more ? find_idlest_of(peer, wanted, now_ns) : NULL;
        found = link ? link : found;
    }
    return found;
}
