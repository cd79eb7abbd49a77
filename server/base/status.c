#include "server/base/status.h"
#include "protocol/json_result.h"

/* The caller's mistake is 4xx, the machine's 5xx. The compiler misses no row. */
struct http_status http_status_of(enum pen_code code)
{
    switch (code) {
#define ROW(code, ...)                                                                             \
    case PEN_##code:                                                                               \
        return (struct http_status){__VA_ARGS__}
        ROW(OK, 200, "OK", false);
        ROW(MALFORMED, 400, "Bad Request", false);
        ROW(INVALID, 422, "Unprocessable Content", false);
        ROW(TOO_BIG, 413, "Content Too Large", false);
        ROW(UNKNOWN_TYPE, 415, "Unsupported Media Type", false);
        ROW(NOT_FOUND, 404, "Not Found", false);
        ROW(INTERNAL, 500, "Internal Server Error", false);
        ROW(LOST, 500, "Internal Server Error", true);
        ROW(UNAVAILABLE, 503, "Service Unavailable", true);
        ROW(DEADLINE, 504, "Gateway Timeout", true);
        ROW(FULL, 507, "Insufficient Storage", false);
        ROW(UNAUTHORIZED, 401, "Unauthorized", false);
        ROW(FORBIDDEN, 403, "Forbidden", false);
        ROW(MISDIRECTED, 421, "Misdirected Request", false);
        ROW(TOO_MANY, 429, "Too Many Requests", true);
        ROW(HELD_BACK, 422, "Unprocessable Content", true);
        ROW(TIMEOUT, 408, "Request Timeout", true);
        ROW(METHOD_NOT_ALLOWED, 405, "Method Not Allowed", false);
        ROW(NOT_ACCEPTABLE, 406, "Not Acceptable", false);
        ROW(AMBIGUOUS, 409, "Conflict", false);
        ROW(RANGE, 416, "Range Not Satisfiable", false);
        ROW(URI_TOO_LONG, 414, "URI Too Long", false);
        ROW(HEADER_TOO_BIG, 431, "Request Header Fields Too Large", false);
#undef ROW
    case PEN_CODES:
        break;
    }
    return http_status_of(PEN_INTERNAL);
}

const char *http_status_title(uint32_t status)
{
    for (uint32_t code = 0; code < PEN_CODES; code++)
        if (http_status_of(code).status == status)
            return http_status_of(code).title;
    return http_status_of(PEN_INTERNAL).title;
}

char *http_problem(const struct pen_error *error, const char *request_id)
{
    struct http_status told = http_status_of(error->code);
    return pen_problem_json(error, told.status, told.title, told.retryable, request_id);
}
