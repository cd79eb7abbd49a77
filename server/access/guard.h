/* Browsers lend any page the place in the network that their user has. Whether a request is meant
 * for this service, and not for a name that somebody made lead here (DNS rebinding), and whether one
 * that changes something comes from a page that may send it. Other programs are not held up. */
#pragma once
#include "protocol/error.h"

struct guard {
    const char *names;  /* that others than itself call this service by, with commas; "*": any */
    const char *own;    /* another name of its own, or "" */
    const char *origin; /* whose pages may call, "*": everybody's, "": nobody else's */
};

/* Headers; NULL: not there. */
struct guard_request {
    const char *method, *host, *origin, *site, *authorization;
    const char *scheme; /* "http" or "https", of the client's side of a proxy; NULL: not known */
};

/* Always let through: addresses, names of one label and those under localhost, local and internal,
 * which nobody can register, and the name of this machine. Errors: PEN_MISDIRECTED. */
bool guard_host(const struct guard *guard, const char *host, struct pen_error *error);
/* Of methods other than GET, HEAD and OPTIONS, by Sec-Fetch-Site and Origin; who sends a token has
 * it from somewhere else than a browser's jar. Errors: PEN_FORBIDDEN. */
bool guard_page(
    const struct guard *guard, const struct guard_request *request, struct pen_error *error);
