/* Where a request begins and ends in the bytes that a client sends (RFC 9112), judged before the HTTP
 * library reads them: what it takes otherwise than the standard says, or than the next proxy does,
 * does not reach it. */
#pragma once
#include "protocol/error.h"
#include <stddef.h>

#define FRAMING_MAX_TARGET 8192 /* bytes of a request target; beyond it 414 */
#define FRAMING_MAX_HEAD (28u << 10)
#define FRAMING_MAX_FIELDS 100 /* beyond these two 431 */
#define FRAMING_MAX_LINE 512   /* of a chunk's size, or a field behind the body */

enum framing_state {
    FRAMING_HEAD,
    FRAMING_LENGTH, /* a body of known length */
    FRAMING_CHUNK_LINE,
    FRAMING_CHUNK,
    FRAMING_CHUNK_END,
    FRAMING_TRAILER,
    FRAMING_OVER,
};

struct framing {
    enum framing_state state;
    size_t scanned;              /* of the header */
    size_t blank;                /* empty lines before it: not to be passed on */
    uint64_t left;               /* bytes of the body, or of the chunk */
    uint32_t digits;             /* of a chunk's size */
    bool extension;              /* behind it */
    bool cr;                     /* a CR came, and its LF must follow */
    char line[FRAMING_MAX_LINE]; /* of a trailer */
    uint32_t line_bytes, trailers;
    bool closes; /* the client wants no further answer on this connection */
};

/* For the next request. */
void framing_init(struct framing *framing);
/* Judges the header at the beginning of `text`, which may be called with more of the same bytes until
 * it is complete: its length (with framing->blank), 0: not all there yet, -1: an error, after which
 * the connection cannot be read any more. Errors: PEN_MALFORMED, PEN_URI_TOO_LONG,
 * PEN_HEADER_TOO_BIG. */
int64_t framing_head(
    struct framing *framing, const char *text, size_t bytes, struct pen_error *error);
/* What the library would take apart beyond the memory that it has for it, and nobody wants from it, it is
 * not shown: the `?` of the target becomes FRAMING_QUERY, which no target has, and Cookie another name. Of
 * a header that was judged. */
#define FRAMING_QUERY '#'
void framing_veil(char *head, size_t bytes);
/* How many of the bytes belong to the request's body, until the state is FRAMING_OVER; -1: an error. What
 * of them is to be passed on is moved to the beginning of `data`, *kept bytes of it: not the extensions
 * of chunks, nor the fields behind the last one, which nobody asked for. */
int64_t framing_body(
    struct framing *framing, char *data, size_t bytes, size_t *kept, struct pen_error *error);
