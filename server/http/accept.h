/* The Accept header (RFC 9110, section 12.5.1). */
#pragma once
#include <stdbool.h>

/* True when `type` ("image/png") may be sent; a missing header allows everything. */
bool accept_allows(const char *accept, const char *type);
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
