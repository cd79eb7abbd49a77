/* One event after the other to everybody who listens, as server-sent events: each is the newest when it
 * is sent, so that a slow listener gets fewer, never old ones. Thread-safe. */
#pragma once
#include "server/http/http.h"

struct feed;
/* `make` gives the data of the next event, one line, malloc'd; called every interval_ms, on a thread
 * of the feed's, as long as anybody listens. */
struct feed *feed_create(
    const char *event, uint32_t interval_ms, char *(*make)(void *context), void *context);
/* Ends every stream, those that begin later at once; `make` is not called any more. By one thread. */
void feed_close(struct feed *feed);
/* After the last stream has been released. */
void feed_destroy(struct feed *feed);
/* Answers with the newest event and all that come. */
void feed_answer(struct feed *feed, struct http_exchange *exchange);
