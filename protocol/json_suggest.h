/* Finds the word that a mistyped one was probably meant to be. */
#pragma once
#include <stddef.h>

struct pen_suggestion {
    const char *word;  /* what was given */
    const char *best;  /* the closest candidate so far, or NULL: none is close */
    unsigned distance; /* edits between the two */
};

/* Considers one more candidate. Distance: insertions, deletions, substitutions and swaps of
 * neighbours (optimal string alignment); close means at most a third of the word, and at most 3. */
void pen_suggest(struct pen_suggestion *suggestion, const char *candidate);

/* "; did you mean \"x\"?" or "." in `text`, to end a sentence with. */
const char *pen_suggest_end(const struct pen_suggestion *suggestion, char *text, size_t bytes);
