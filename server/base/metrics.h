/* What the service counts: for /metrics (Prometheus text) and /v1/stats (rolling, JSON). */
#pragma once
#include "protocol/json_writer.h"
#include "protocol/result.h"
#include "protocol/technique_info.h"

struct metrics;
struct metrics *metrics_create(const struct pen_catalogue *catalogue);
void metrics_destroy(struct metrics *metrics);

/* One answered request. `route` is a constant string: a pattern, never the client's text. */
void metrics_request(struct metrics *metrics, const char *route, uint32_t status, double ms);
/* One picture that a worker made. */
void metrics_render(struct metrics *metrics, const struct pen_result *result);
/* Front end's own time of one render request: total minus every stage. */
void metrics_overhead(struct metrics *metrics, double ms);

/* A growing text for the exposition format. */
struct metrics_text {
    char *text;
    size_t size, capacity;
};
void metrics_print(struct metrics_text *text, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
/* "# HELP", "# TYPE" and one unlabelled sample. */
void metrics_print_one(
    struct metrics_text *text, const char *name, const char *type, const char *help, double value);
/* Everything that metrics.c itself counts. */
void metrics_write(struct metrics *metrics, struct metrics_text *text);
/* "recent": of the renders of the last `ms` (512 at most) how many, and the spread of their times. */
void metrics_write_recent(struct metrics *metrics, uint64_t ms, struct pen_json *json);
/* Rolling per-method and per-stage timings of the last renders; malloc'd JSON. */
char *metrics_stats_json(struct metrics *metrics);
