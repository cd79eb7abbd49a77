/* How what went wrong is told over HTTP. */
#pragma once
#include "protocol/error.h"

struct http_status {
    uint32_t status;
    const char *title; /* of the status, as RFC 9110 calls it */
    bool retryable;    /* the same request may succeed later */
};
struct http_status http_status_of(enum pen_code code);
/* The title of a status that http_status_of gives; never NULL. */
const char *http_status_title(uint32_t status);
/* The problem document that tells it, malloc'd. `request_id` may be NULL. */
char *http_problem(const struct pen_error *error, const char *request_id);
