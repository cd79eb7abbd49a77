/* Which worker has what the frames of a session have left: the next one goes there. */
#pragma once
#include "server/queue/scheduler.h"

#define HOMES_MOST 256

struct homes;
struct homes *homes_create(void);
void homes_destroy(struct homes *homes);
/* Any thread. A worker takes this render; nothing happens when that is not a frame of a session. */
void homes_take(struct homes *homes, const struct render *render, uint32_t worker, uint64_t now_ns);
/* Another worker has what this one would go on from, and it has not waited for that too long. One that
 * has waited goes on without: that is right, too. */
bool homes_is_away(
    struct homes *homes, const struct render *render, uint32_t worker, uint64_t now_ns);
/* The worker has nothing any more. */
void homes_forget(struct homes *homes, uint32_t worker);
uint32_t homes_count(struct homes *homes);
