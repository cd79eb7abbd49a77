/* Query strings. */
#pragma once
#include "protocol/json_request.h"

#define HTTP_MAX_PAIRS 256
/* Splits and percent-decodes `query` (NULL: none) in place. Errors: PEN_MALFORMED. */
bool http_split_query(char *query, struct pen_query_pair pairs[HTTP_MAX_PAIRS], uint32_t *count,
    struct pen_error *error);
/* Percent-decodes in place; false where that cannot be done. */
bool http_decode(char *text, bool plus_is_space);
