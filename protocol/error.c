#include "protocol/error.h"
#include <stdarg.h>
#include <stdio.h>

bool pen_fail(struct pen_error *e, enum pen_code code, const char *pointer, const char *format, ...)
{
    if (!e || e->code != PEN_OK)
        return false;
    e->code = code;
    e->retryable = code == PEN_TOO_MANY || code == PEN_UNAVAILABLE || code == PEN_DEADLINE;
    snprintf(e->pointer, sizeof e->pointer, "%s", pointer ? pointer : "");
    va_list args;
    va_start(args, format);
    vsnprintf(e->message, sizeof e->message, format, args);
    va_end(args);
    return false;
}

const char *pen_code_title(enum pen_code code)
{
    switch (code) {
    case PEN_OK:
        return "OK";
    case PEN_MALFORMED:
        return "Bad Request";
    case PEN_UNAUTHORIZED:
        return "Unauthorized";
    case PEN_NOT_FOUND:
        return "Not Found";
    case PEN_METHOD_NOT_ALLOWED:
        return "Method Not Allowed";
    case PEN_NOT_ACCEPTABLE:
        return "Not Acceptable";
    case PEN_TIMEOUT:
        return "Request Timeout";
    case PEN_TOO_BIG:
        return "Content Too Large";
    case PEN_URI_TOO_LONG:
        return "URI Too Long";
    case PEN_UNKNOWN_TYPE:
        return "Unsupported Media Type";
    case PEN_INVALID:
        return "Unprocessable Content";
    case PEN_TOO_MANY:
        return "Too Many Requests";
    case PEN_INTERNAL:
        return "Internal Server Error";
    case PEN_UNAVAILABLE:
        return "Service Unavailable";
    case PEN_DEADLINE:
        return "Gateway Timeout";
    }
    return "Error";
}
