/* The log: one line per event or request, on stderr, each written at once. */
#pragma once
#include "server/base/config.h"
#include <stdint.h>

enum log_level { LOG_INFO, LOG_ERROR };

void log_init(enum config_log_format format);
void log_event(enum log_level level, const char *format, ...) __attribute__((format(printf, 2, 3)));

struct log_request {
    const char *listener, *request_id, *trace_id; /* trace_id may be NULL */
    const char *client, *method, *target;
    uint32_t status;
    uint64_t bytes;
    double ms;             /* from the end of the header to the last byte sent */
    const char *scene;     /* id, or NULL */
    const char *token;     /* its name, or NULL */
    const char *technique; /* renders only, else NULL */
    double queue_ms, render_ms;
    bool cached;
    enum pen_code code;
    const char *error; /* message to the client, or NULL */
    bool aborted;      /* the client did not get all of it */
};
void log_write_request(const struct log_request *request);
