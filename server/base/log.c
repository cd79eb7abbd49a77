#include "server/base/log.h"
#include "protocol/json_writer.h"
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static enum config_log_format log_format; /* set once, before the first thread */

void log_init(enum config_log_format format)
{
    log_format = format;
}

static void time_stamp(char text[40])
{
    struct timespec now;
    struct tm utc;
    clock_gettime(CLOCK_REALTIME, &now);
    gmtime_r(&now.tv_sec, &utc);
    size_t n = strftime(text, 40, "%Y-%m-%dT%H:%M:%S", &utc);
    snprintf(text + n, 40 - n, ".%03ldZ", now.tv_nsec / 1000000);
}

/* One write per line, so that lines of several threads do not mix. */
static void put(const char *line, size_t bytes)
{
    if (write(STDERR_FILENO, line, bytes) < 0)
        return; /* a log that cannot be written must not stop the service */
}

static void put_json(struct pen_json *json)
{
    size_t bytes;
    pen_json_end(json);
    char *text = pen_json_finish(json, &bytes);
    text[bytes] = '\n'; /* where the NUL was */
    put(text, bytes + 1);
    free(text);
}

void log_event(enum log_level level, const char *format, ...)
{
    char stamp[40], message[1024], line[1100];
    va_list args;
    va_start(args, format);
    vsnprintf(message, sizeof message, format, args);
    va_end(args);
    time_stamp(stamp);
    if (log_format == CONFIG_LOG_TEXT) {
        int n = snprintf(
            line, sizeof line, "%s %s %s\n", stamp, level == LOG_ERROR ? "error" : "info", message);
        put(line, n < (int)sizeof line ? (size_t)n : sizeof line - 1);
        return;
    }
    struct pen_json json = {0};
    pen_json_object(&json, NULL);
    pen_json_string(&json, "time", stamp);
    pen_json_string(&json, "level", level == LOG_ERROR ? "error" : "info");
    pen_json_string(&json, "message", message);
    put_json(&json);
}

/* A client's text on a line of ours: no control characters, bounded. */
static void copy_printable(char *to, size_t bytes, const char *from)
{
    size_t n = 0;
    for (; from[n] && n + 1 < bytes; n++)
        to[n] = from[n] > 0x20 && from[n] < 0x7f ? from[n] : '?';
    to[n] = 0;
}

void log_write_request(const struct log_request *r)
{
    char stamp[40], target[512], method[16];
    time_stamp(stamp);
    copy_printable(target, sizeof target, r->target);
    copy_printable(method, sizeof method, r->method);
    if (log_format == CONFIG_LOG_TEXT) {
        char line[2048];
        int n = snprintf(line, sizeof line, "%s %s %s %s %s %s %u %llu B %.1f ms", stamp,
            r->listener, r->request_id, r->client, method, target, r->status,
            (unsigned long long)r->bytes, r->ms);
        if (r->token)
            n += snprintf(line + n, sizeof line - (size_t)n, " token %s", r->token);
        if (r->scene)
            n += snprintf(line + n, sizeof line - (size_t)n, " scene %s", r->scene);
        if (r->technique)
            n += snprintf(line + n, sizeof line - (size_t)n, " %s%s queue %.1f render %.1f",
                r->technique, r->cached ? " cached" : "", r->queue_ms, r->render_ms);
        if (r->trace_id)
            n += snprintf(line + n, sizeof line - (size_t)n, " trace %s", r->trace_id);
        if (r->aborted)
            n += snprintf(line + n, sizeof line - (size_t)n, " aborted");
        if (r->error)
            n += snprintf(line + n, sizeof line - (size_t)n, " %s: \"%.200s\"",
                pen_code_name(r->code), r->error);
        if (n > (int)sizeof line - 2)
            n = sizeof line - 2;
        line[n++] = '\n';
        put(line, (size_t)n);
        return;
    }
    struct pen_json json = {0};
    pen_json_object(&json, NULL);
    pen_json_string(&json, "time", stamp);
    pen_json_string(&json, "listener", r->listener);
    pen_json_string(&json, "request_id", r->request_id);
    if (r->trace_id)
        pen_json_string(&json, "trace_id", r->trace_id);
    pen_json_string(&json, "client", r->client);
    pen_json_string(&json, "method", method);
    pen_json_string(&json, "target", target);
    pen_json_uint(&json, "status", r->status);
    pen_json_uint(&json, "bytes", r->bytes);
    pen_json_double(&json, "ms", r->ms);
    if (r->token)
        pen_json_string(&json, "token", r->token);
    if (r->scene)
        pen_json_string(&json, "scene", r->scene);
    if (r->technique) {
        pen_json_string(&json, "technique", r->technique);
        pen_json_bool(&json, "cached", r->cached);
        pen_json_double(&json, "queue_ms", r->queue_ms);
        pen_json_double(&json, "render_ms", r->render_ms);
    }
    if (r->error) {
        pen_json_string(&json, "code", pen_code_name(r->code));
        pen_json_string(&json, "error", r->error);
    }
    if (r->aborted)
        pen_json_bool(&json, "aborted", true);
    put_json(&json);
}
