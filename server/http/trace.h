/* W3C Trace Context: whose larger undertaking a request is part of. */
#pragma once

struct http_trace {
    char id[33], flags[3]; /* "" without a (valid) traceparent */
};
/* `parent`: the header, or NULL. What is malformed is ignored, as the standard says. */
void http_trace_read(struct http_trace *trace, const char *parent);
/* The header that says that this daemon took part; trace->id must not be "". */
#define HTTP_TRACE_BYTES 56
void http_trace_answer(const struct http_trace *trace, char text[HTTP_TRACE_BYTES]);
