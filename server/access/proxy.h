/* Proxies in front of this service: whom to believe what they say of their clients, and under what path
 * they offer it. */
#pragma once
#include "protocol/error.h"

#define PROXY_PREFIX_BYTES 128
#define PROXY_NAME_BYTES 256

/* Whether a comma-separated list of addresses and networks ("10.0.0.0/8", "::1") has this one. */
bool proxy_is_listed(const char *list, const char *address);
/* Errors: PEN_INVALID, with the entry that is neither. */
bool proxy_check_list(const char *list, struct pen_error *error);
/* The address in X-Forwarded-For that the last of the listed proxies was called from; false: none. */
bool proxy_client(const char *list, const char *forwarded, char client[64]);
/* The path in "https://host/path/", without its last slash; "" for the root. Errors: PEN_INVALID. */
bool proxy_split_url(const char *url, char host[PROXY_NAME_BYTES], char prefix[PROXY_PREFIX_BYTES],
    struct pen_error *error);
/* The scheme in X-Forwarded-Proto (NULL: not there), or that a URL begins with; NULL: none that is known. */
const char *proxy_scheme(const char *text);
/* X-Forwarded-Prefix, NULL: not there. False when it is no path. */
bool proxy_prefix(const char *forwarded, char prefix[PROXY_PREFIX_BYTES]);
