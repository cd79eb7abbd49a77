/* The Accept header (RFC 9110, section 12.5.1). */
#pragma once
#include <stdbool.h>

/* True when `type` ("image/png") may be sent; a missing header allows everything. */
bool accept_allows(const char *accept, const char *type);
/* True when a content coding ("gzip") may be sent, by the Accept-Encoding header (RFC 9110, section
 * 12.5.3); a missing header allows none, as few who send none can undo one. */
bool accept_coding(const char *accept, const char *coding);
/* In what form the answer to a render is wanted. */
enum accept_form {
    ACCEPT_PICTURE,
    ACCEPT_RECORD, /* application/json */
    ACCEPT_PARTS,  /* multipart/x-mixed-replace: the picture as it gets better */
    ACCEPT_EVENTS, /* text/event-stream: records of the same */
    ACCEPT_FORMS
};
extern const char *const accept_form_mime[ACCEPT_FORMS]; /* NULL for the picture */
/* Another form than the picture must be named in the header, with at least the quality of the
 * picture; among several, the one with the highest quality, and then the first above. */
enum accept_form accept_form(const char *accept);
