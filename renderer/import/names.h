/* Names of uploaded files, and which of them a URI in a glTF document means. Shared by whoever
 * takes an upload apart, puts one together, or reads one. */
#pragma once
#include "renderer/import/bundle.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* True for a relative name of '/'-separated parts, none empty, "." or "..", without control
 * characters, backslashes or a colon. */
bool pen_name_is_safe(const char *name, size_t bytes);
/* The name that a file of an upload goes by: '\' written as '/', without a drive or "C:\fakepath\"
 * (which browsers put there) in front, and with empty parts, "." and ".." folded. False when that is
 * not safe or leads outside. */
bool pen_name_tidy(const char *given, size_t bytes, char name[PEN_BUNDLE_MAX_NAME + 1]);

struct pen_name_keys;
struct pen_names {
    uint32_t count;
    struct pen_name_keys *keys;
};

/* `names` are safe ones, and must outlive *index. */
void pen_names_init(struct pen_names *index, const char *const *names, uint32_t count);
/* Says of a name that its letters beyond ASCII were read in a code page that may not be its own. */
void pen_names_doubt(struct pen_names *index, uint32_t number);
void pen_names_finish(struct pen_names *index);

enum { PEN_NAME_UNKNOWN = -1, PEN_NAME_AMBIGUOUS = -2, PEN_NAME_ELSEWHERE = -3 };
/* The number of the name that `uri`, relative to the folder of the file called `base`, means. URIs
 * are taken as written by people: percent-encoded or not, with a query or not, '\' for '/', in
 * either Unicode normal form, and in other case or width where only one name fits. Of names in doubt the only one
 * that may be the same letters in another code page is taken. `loose`: a file that is
 * not where the URI says, or is said to lie outside the upload, is taken by its last part when only
 * one name ends in it, as forms drop the folders. Else one of the above; PEN_NAME_ELSEWHERE: it is
 * an address on a network, outside, or nothing that a file could be called. */
int64_t pen_names_find(
    const struct pen_names *index, const char *base, const char *uri, bool loose);
