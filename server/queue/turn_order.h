/* Whose turn it is, of the renders that a worker has in progress: how long each client has had the
 * renderer lately decides, so that one who asks for little does not wait for one who asks for much. */
#pragma once
#include "server/queue/accounts.h"

struct turn_order {
    const struct account *account; /* whose time it takes */
    uint64_t arrived;              /* a number that grows */
    double ms;                     /* that it has had */
};

/* The next of `count` (NULL: there are none). `current` had the turn last, NULL: it has ended. One that
 * has only begun goes on, as long as nobody waits who has had much less, or who is interactive when it
 * is not. */
const struct turn_order *turn_order_next(
    const struct turn_order *const *turns, uint32_t count, const struct turn_order *current);
