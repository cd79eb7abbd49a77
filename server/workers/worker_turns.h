/* Renders in progress in the worker: they take turns on the one context. Whose turn it is depends on
 * how long each client has had the renderer lately, so that one who asks for little does not wait
 * for one who asks for much. */
#pragma once
#include "renderer/renderer.h"
#include "server/workers/worker_item.h"

#define WORKER_TURN_MS 25.0

struct worker_turns;
/* `on_part` gets pictures so far, each an item of its own, of jobs for which they are wanted. */
struct worker_turns *worker_turns_create(struct pen_renderer *renderer,
    void (*on_part)(void *context, struct worker_item *part), void *context);
void worker_turns_destroy(struct worker_turns *turns); /* gives up what is in progress */

/* Begins a render that was admitted; `client` 0 is one of its own. The item stays
 * with the turns until they give it back, unless this fails with item->message.result.error. */
bool worker_turns_begin(struct worker_turns *turns, const struct pen_request *request,
    uint64_t client, struct worker_item *item);
/* The job's picture so far would be taken, once. Nothing happens when it is not in progress. */
void worker_turns_want(struct worker_turns *turns, uint64_t job);
/* The job whose turn is next; 0: none is in progress. */
uint64_t worker_turns_next(struct worker_turns *turns);
/* Where that job is. */
struct pen_place worker_turns_place(const struct worker_turns *turns);
/* One turn of that job. Its item once it has ended, well or not; else NULL. */
struct worker_item *worker_turns_run(struct worker_turns *turns);
/* Gives a job up. Its item, with an error; NULL when it is not in progress. */
struct worker_item *worker_turns_cancel(struct worker_turns *turns, uint64_t job);
