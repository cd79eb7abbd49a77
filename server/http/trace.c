#include "server/http/trace.h"
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

/* 00-<32 hex>-<16 hex>-<2 hex> */
void http_trace_read(struct http_trace *trace, const char *parent)
{
    static const char hex[] = "0123456789abcdef";
    memset(trace, 0, sizeof *trace);
    if (!parent || strlen(parent) != HTTP_TRACE_BYTES - 1 || strncmp(parent, "00-", 3) ||
        parent[35] != '-' || parent[52] != '-' || strspn(parent + 3, hex) != 32 ||
        strspn(parent + 36, hex) != 16 || strspn(parent + 53, hex) != 2 ||
        strspn(parent + 3, "0") == 32)
        return;
    memcpy(trace->id, parent + 3, 32);
    memcpy(trace->flags, parent + 53, 2);
}

void http_trace_answer(const struct http_trace *trace, char text[HTTP_TRACE_BYTES])
{
    uint64_t span;
    if (getrandom(&span, sizeof span, 0) != sizeof span)
        abort();
    snprintf(text, HTTP_TRACE_BYTES, "00-%s-%016llx-%s", trace->id, (unsigned long long)span,
        trace->flags);
}
