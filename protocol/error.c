#include "protocol/error.h"
#include <stdarg.h>
#include <stdio.h>

static const struct {
    const char *name;
    uint8_t blame; /* enum pen_blame */
    bool anyones;  /* not only the front end's */
} codes[PEN_CODES] = {
#define PEN_CODE(code, word, blame) {word, PEN_BLAME_##blame, true},
#define PEN_FRONT_CODE(code, word, blame) {word, PEN_BLAME_##blame, false},
#include "protocol/codes.def"
};

bool pen_fail(struct pen_error *e, enum pen_code code, const char *pointer, const char *format, ...)
{
    if (!e || e->code != PEN_OK)
        return false;
    e->code = code;
    e->retry_after_s = 0;
    snprintf(e->pointer, sizeof e->pointer, "%s", pointer ? pointer : "");
    va_list args;
    va_start(args, format);
    vsnprintf(e->message, sizeof e->message, format, args);
    va_end(args);
    return false;
}

void pen_error_receive(struct pen_error *e)
{
    if (e->code >= PEN_CODES || !codes[e->code].anyones)
        e->code = PEN_INTERNAL;
    e->retry_after_s = 0;
    e->pointer[sizeof e->pointer - 1] = 0;
    e->message[sizeof e->message - 1] = 0;
}

const char *pen_code_name(uint32_t code)
{
    return code < PEN_CODES ? codes[code].name : "unknown";
}

enum pen_blame pen_code_blame(uint32_t code)
{
    return code < PEN_CODES ? (enum pen_blame)codes[code].blame : PEN_BLAME_MACHINE;
}
