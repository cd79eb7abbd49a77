/* Starts, feeds, watches and replaces the workers. One thread per worker; it alone touches that
 * worker's process and socket. */
#pragma once
#include "server/workers/quarantine.h"
#include "server/workers/worker_figures.h"

struct worker_pool;
struct worker_pool *worker_pool_create(const struct worker_pool_config *config);
/* Ends the workers and the threads. Nobody may still wait in the scheduler. */
void worker_pool_destroy(struct worker_pool *pool);

/* There may be work: wakes the threads. Any thread. */
void worker_pool_wake(struct worker_pool *pool);
/* Tells the workers that a scene was deleted. */
void worker_pool_drop_scene(struct worker_pool *pool, const uint8_t scene[PEN_ID_BYTES]);
/* A worker has the scene in GPU memory. */
bool worker_pool_is_resident(struct worker_pool *pool, const uint8_t scene[PEN_ID_BYTES]);
/* Seconds for which a scene that ended two workers is still refused; 0: it is not. */
/* As quarantine_check. */
enum quarantined worker_pool_quarantined(
    struct worker_pool *pool, const struct pen_request *request, uint32_t *remaining_s);

void worker_pool_read(struct worker_pool *pool, struct worker_pool_numbers *numbers);
