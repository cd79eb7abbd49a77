#include "server/http/query.h"
#include "protocol/hex.h"
#include <string.h>

bool http_decode(char *text, bool plus_is_space)
{
    char *to = text;
    for (const char *from = text; *from; from++) {
        if (*from != '%') {
            *to++ = *from == '+' && plus_is_space ? ' ' : *from;
            continue;
        }
        int high = pen_hex_digit(from[1]), low = high < 0 ? -1 : pen_hex_digit(from[2]);
        if (low < 0 || (high == 0 && low == 0))
            return false;
        *to++ = (char)(high * 16 + low);
        from += 2;
    }
    *to = 0;
    return true;
}

bool http_split_query(char *query, struct pen_query_pair pairs[HTTP_MAX_PAIRS], uint32_t *count,
    struct pen_error *error)
{
    *count = 0;
    for (char *at = query, *next; at && *at; at = next) {
        next = strchr(at, '&');
        if (next)
            *next++ = 0;
        if (!*at)
            continue;
        char *value = strchr(at, '=');
        if (value)
            *value++ = 0;
        if (*count == HTTP_MAX_PAIRS)
            return pen_fail(error, PEN_MALFORMED, "", "The query has too many keys.");
        if (!http_decode(at, true) || (value && !http_decode(value, true)))
            return pen_fail(error, PEN_MALFORMED, "", "The query has an invalid percent-encoding.");
        pairs[(*count)++] = (struct pen_query_pair){at, value};
    }
    return true;
}
