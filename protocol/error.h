/* Errors that cross layers: one code, one message for the client, one JSON pointer. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

/* Each code is the HTTP status it becomes; 4xx is the client's mistake, 5xx the machine's. */
enum pen_code {
    PEN_OK = 0,
    PEN_MALFORMED = 400,
    PEN_UNAUTHORIZED = 401,
    PEN_NOT_FOUND = 404,
    PEN_METHOD_NOT_ALLOWED = 405,
    PEN_NOT_ACCEPTABLE = 406,
    PEN_TIMEOUT = 408, /* the client was too slow to send its request */
    PEN_TOO_BIG = 413,
    PEN_URI_TOO_LONG = 414,
    PEN_UNKNOWN_TYPE = 415,
    PEN_INVALID = 422,
    PEN_TOO_MANY = 429,
    PEN_INTERNAL = 500,
    PEN_UNAVAILABLE = 503,
    PEN_DEADLINE = 504,
};

struct pen_error {
    uint32_t code;      /* enum pen_code; PEN_OK: nothing went wrong */
    uint32_t retryable; /* 1: the same request may succeed later */
    char pointer[128];  /* RFC 6901 pointer into the request body, or "" */
    char message[512]; /* one sentence for the client; never a path or an address of this process */
};

/* Fills *e (which may be NULL) and returns false, so that a caller can `return pen_fail(...)`.
 * The first failure wins: an error that is already filled is kept. */
bool pen_fail(struct pen_error *e, enum pen_code code, const char *pointer, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

/* "Unprocessable Content" and so on; never NULL. */
const char *pen_code_title(enum pen_code code);
