#include "server/http/range.h"
#include <ctype.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#define TAG_BYTES 80

/* A number of digits only; UINT64_MAX for one that is too large. */
static const char *read_number(const char *text, uint64_t *number)
{
    char *end = (char *)text;
    if (!isdigit((unsigned char)*text))
        return NULL;
    errno = 0;
    *number = strtoull(text, &end, 10);
    if (errno)
        *number = UINT64_MAX;
    return end;
}

enum range range_read(const char *range, const char *if_range, const char *tag, uint64_t bytes,
    uint64_t *from, uint64_t *count)
{
    char quoted[TAG_BYTES];
    uint64_t first, last = UINT64_MAX;
    snprintf(quoted, sizeof quoted, "\"%s\"", tag);
    if (!range || strncasecmp(range, "bytes=", 6) || (if_range && strcmp(if_range, quoted)))
        return RANGE_ALL;
    range += 6 + strspn(range + 6, " \t");
    if (*range == '-') { /* the last ones */
        uint64_t most;
        const char *end = read_number(range + 1, &most);
        if (!end || end[strspn(end, " \t")])
            return RANGE_ALL;
        *count = most < bytes ? most : bytes;
        *from = bytes - *count;
        return *count ? RANGE_PART : RANGE_OUTSIDE;
    }
    const char *end = read_number(range, &first);
    if (!end || *end++ != '-')
        return RANGE_ALL;
    if (isdigit((unsigned char)*end))
        end = read_number(end, &last);
    if (end[strspn(end, " \t")] || last < first)
        return RANGE_ALL;
    if (first >= bytes)
        return RANGE_OUTSIDE;
    *from = first;
    *count = (last < bytes ? last + 1 : bytes) - first;
    return RANGE_PART;
}
