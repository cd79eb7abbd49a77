#include "server/http/accept.h"
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* The weight of the item that begins at `at`, `bytes` long, 0 to 1. */
static double weight(const char *at, size_t bytes)
{
    double q = 1;
    for (const char *p = memchr(at, ';', bytes); p && p < at + bytes;) {
        p++;
        p += strspn(p, " \t");
        if ((*p == 'q' || *p == 'Q') && p[1] == '=')
            q = strtod(p + 2, NULL);
        p = memchr(p, ';', (size_t)(at + bytes - p));
    }
    return q;
}

/* The quality, 0 to 1, that the most specific matching range gives to `type`; -1: none matches.
 * *exact is true when the type itself is named. */
static double quality(const char *accept, const char *type, bool *exact)
{
    size_t type_bytes = strlen(type), major = (size_t)(strchr(type, '/') - type) + 1;
    double best = -1;
    int best_level = 0;
    for (const char *at = accept; at;) {
        at += strspn(at, " \t,");
        size_t item = strcspn(at, ","), range = strcspn(at, ",; \t");
        int level = 0;
        if (range == type_bytes && !strncasecmp(at, type, type_bytes))
            level = 3;
        else if (range == major + 1 && at[major] == '*' && !strncasecmp(at, type, major))
            level = 2;
        else if (range == 3 && !strncmp(at, "*/*", 3))
            level = 1;
        if (level > best_level) {
            best = weight(at, item);
            best_level = level;
        }
        at = at[item] ? at + item + 1 : NULL;
    }
    if (exact)
        *exact = best_level == 3;
    return best;
}

bool accept_allows(const char *accept, const char *type)
{
    return !accept || quality(accept, type, NULL) > 0;
}

bool accept_coding(const char *accept, const char *coding)
{
    double named = -1, any = -1;
    for (const char *at = accept; at;) {
        at += strspn(at, " \t,");
        size_t item = strcspn(at, ","), word = strcspn(at, ",; \t");
        if (word == strlen(coding) && !strncasecmp(at, coding, word))
            named = weight(at, item);
        else if (word == 1 && *at == '*')
            any = weight(at, item);
        at = at[item] ? at + item + 1 : NULL;
    }
    return (named >= 0 ? named : any) > 0;
}

const char *const accept_form_mime[ACCEPT_FORMS] = {
    NULL, "application/json", "multipart/x-mixed-replace", "text/event-stream"};

enum accept_form accept_form(const char *accept)
{
    enum accept_form best = ACCEPT_PICTURE;
    if (!accept)
        return best;
    double best_q = quality(accept, "image/png", NULL);
    for (enum accept_form form = ACCEPT_RECORD; form < ACCEPT_FORMS; form++) {
        bool exact = false;
        double q = quality(accept, accept_form_mime[form], &exact);
        bool better = best == ACCEPT_PICTURE ? q >= best_q : q > best_q;
        if (!exact || q <= 0 || !better)
            continue;
        best = form;
        best_q = q;
    }
    return best;
}
