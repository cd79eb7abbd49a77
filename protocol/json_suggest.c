#include "protocol/json_suggest.h"
#include <stdio.h>
#include <string.h>

#define LONGEST 40

static unsigned least(unsigned a, unsigned b)
{
    return a < b ? a : b;
}

/* Optimal string alignment distance over three rows of the table. */
static unsigned edit_distance(const char *a, size_t a_length, const char *b, size_t b_length)
{
    unsigned rows[3][LONGEST + 1];
    unsigned *before = rows[0], *last = rows[1], *now = rows[2];
    for (size_t j = 0; j <= b_length; j++)
        last[j] = (unsigned)j;
    for (size_t i = 1; i <= a_length; i++) {
        now[0] = (unsigned)i;
        for (size_t j = 1; j <= b_length; j++) {
            unsigned change = last[j - 1] + (a[i - 1] != b[j - 1]);
            now[j] = least(change, least(last[j], now[j - 1]) + 1);
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                now[j] = least(now[j], before[j - 2] + 1);
        }
        unsigned *recycled = before;
        before = last;
        last = now;
        now = recycled;
    }
    return last[b_length];
}

void pen_suggest(struct pen_suggestion *suggestion, const char *candidate)
{
    size_t length = strlen(suggestion->word), other = strlen(candidate);
    if (length > LONGEST || other > LONGEST)
        return;
    unsigned distance = edit_distance(suggestion->word, length, candidate, other);
    unsigned close = least(3, (unsigned)(length > other ? length : other) / 3);
    if (distance > close || (suggestion->best && distance >= suggestion->distance))
        return;
    suggestion->best = candidate;
    suggestion->distance = distance;
}

const char *pen_suggest_end(const struct pen_suggestion *suggestion, char *text, size_t bytes)
{
    if (suggestion->best)
        snprintf(text, bytes, "; did you mean \"%s\"?", suggestion->best);
    else
        snprintf(text, bytes, ".");
    return text;
}
