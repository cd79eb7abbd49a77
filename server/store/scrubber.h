/* Reads all that is stored every so often, while nothing else wants the processor or the disk, so
 * that what went bad is made again before somebody asks for it. */
#pragma once
#include "server/store/scene_store.h"

struct scrubber;
/* period_s: from the beginning of one round to that of the next; 0: never, and NULL. */
struct scrubber *scrubber_create(struct scene_store *store, uint64_t period_s);
void scrubber_destroy(struct scrubber *scrubber); /* NULL is fine */
/* Rounds that came to their end. */
uint64_t scrubber_rounds(struct scrubber *scrubber);
