#include "server/queue/turn_order.h"
#include <math.h>
#include <stddef.h>

/* A render that has only begun is not interrupted by its equals: if all are short, each is done
 * sooner when they come one after the other. */
#define UNDISTURBED_MS 100.0
/* Clients are equals while none has had so much more than another. */
#define EQUALS_MS 100.0

static bool comes_before(const struct turn_order *a, const struct turn_order *b)
{
    double used[] = {a->account->used_ms, b->account->used_ms};
    /* Of one client, what has had least goes first: short ones are done before long ones, seen from
     * whichever side they came. */
    if (a->account == b->account)
        used[0] = floor(a->ms / UNDISTURBED_MS), used[1] = floor(b->ms / UNDISTURBED_MS);
    return used[0] != used[1] ? used[0] < used[1] : a->arrived < b->arrived;
}

const struct turn_order *turn_order_next(
    const struct turn_order *const *turns, uint32_t count, const struct turn_order *current)
{
    const struct turn_order *best = NULL;
    bool interactive = false;
    for (uint32_t i = 0; i < count; i++) {
        interactive |= !turns[i]->account->batch;
        if (!best || comes_before(turns[i], best))
            best = turns[i];
    }
    if (!current || !best || current->ms >= UNDISTURBED_MS)
        return best;
    bool gives_way = (current->account->batch && interactive) ||
                     current->account->used_ms > best->account->used_ms + EQUALS_MS;
    return gives_way ? best : current;
}
