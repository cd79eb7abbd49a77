/* All connections of a door, and whose they are; who of them leaves first when there is no room. */
#pragma once
#include "server/base/clock.h"
#include "server/wire/link.h"
#include "server/wire/peers.h"
#include <stddef.h>

#define CROWD_FRESH_NS (250 * CLOCK_MS) /* until it can be told how quick one is */

struct crowd {
    struct link **links;
    uint32_t count, live; /* live: not on their way out */
    size_t capacity;
    struct peers peers;
};

/* `peer` is the link's from here on. */
void crowd_enter(struct crowd *crowd, struct link *link, struct peer *peer);
void crowd_leave(struct crowd *crowd, struct link *link);
/* After everything that may change a link's state. */
void crowd_look(struct crowd *crowd, struct link *link);
void crowd_finish(struct crowd *crowd); /* nobody is there any more */

/* Whom to look for. */
struct crowd_wanted {
    const struct peer *peer; /* NULL: of any address */
    bool uploads;            /* with a body that takes up a place */
    bool dying; /* also those that only linger, and these first: for their descriptors */
};
/* Who has kept a place the longest for little, at the address that has most; NULL: nobody has. */
struct link *crowd_find_idlest(
    const struct crowd *crowd, const struct crowd_wanted *wanted, uint64_t now_ns);
