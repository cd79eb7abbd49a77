#include "server/http/tags.h"
#include <string.h>

static const char *skip_blanks(const char *at)
{
    return at + strspn(at, " \t");
}

bool tags_name(const char *list, const char *tag)
{
    bool found = false;
    size_t bytes = strlen(tag);
    for (const char *at = list; *at;) {
        at = skip_blanks(at);
        if (*at == ',') { /* empty elements are allowed */
            at++;
            continue;
        }
        if (!strncmp(at, "W/", 2))
            at += 2;
        if (*at != '"')
            return found && !*at;
        size_t n = strcspn(at + 1, "\"");
        if (at[1 + n] != '"')
            return false;
        found = found || (n == bytes && !memcmp(at + 1, tag, n));
        at = skip_blanks(at + n + 2);
        if (*at && *at != ',')
            return false;
    }
    return found;
}

bool tags_are_any(const char *list)
{
    list = skip_blanks(list);
    return *list == '*' && !*skip_blanks(list + 1);
}
