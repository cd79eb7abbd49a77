/* Errors that cross layers: one code, one message for the client, one JSON pointer. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

enum pen_code {
#define PEN_CODE(code, word, blame) PEN_##code,
#define PEN_FRONT_CODE PEN_CODE
#include "protocol/codes.def"
#undef PEN_FRONT_CODE
#undef PEN_CODE
    PEN_CODES
};

enum pen_blame { PEN_BLAME_NOBODY, PEN_BLAME_CALLER, PEN_BLAME_MACHINE };

struct pen_error {
    uint32_t code; /* enum pen_code; PEN_OK: nothing went wrong */
    uint32_t
        retry_after_s; /* when the same request may succeed; 0: not known, or not a matter of time */
    char pointer[128]; /* RFC 6901 pointer into the request body, or "" */
    char message[512]; /* one sentence for the client; never a path or an address of this process */
};

/* Fills *e (which may be NULL) and returns false, so that a caller can `return pen_fail(...)`.
 * The first failure wins: an error that is already filled is kept. */
bool pen_fail(struct pen_error *e, enum pen_code code, const char *pointer, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

/* Makes safe what another process reported: its texts end, and a code that it cannot have chosen
 * becomes PEN_INTERNAL. */
void pen_error_receive(struct pen_error *e);

/* "too big" and so on, for logs; never NULL. */
const char *pen_code_name(uint32_t code);
enum pen_blame pen_code_blame(uint32_t code);
