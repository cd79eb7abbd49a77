/* What scenes are called: a name and tags each, in a file of the scene's folder. One that is damaged
 * leaves its scene without, and is told of in the log. Thread-safe. */
#pragma once
#include "server/store/scene_store.h"

struct label { /* UTF-8, without control characters */
    char name[PEN_LABEL_NAME_BYTES];
    uint32_t tag_count;
    char tags[PEN_LABEL_TAGS][PEN_LABEL_TAG_BYTES];
};

struct labels;
/* Reads those of all scenes. */
struct labels *labels_open(struct scene_store *store);
void labels_close(struct labels *labels); /* NULL is fine */
/* False, and an empty one, where nothing was ever said. */
bool labels_get(struct labels *labels, const uint8_t id[PEN_ID_BYTES], struct label *label);
/* Keeps it, as far as a loss of power. Errors: PEN_NOT_FOUND, PEN_UNAVAILABLE, PEN_FULL. */
bool labels_set(struct labels *labels, const uint8_t id[PEN_ID_BYTES], const struct label *label,
    struct pen_error *error);
/* A scene was sent, and `stored` anew or there already: what is known of it is kept with it, and `name`
 * (of the file that it came in, "" when nobody said) is its name where it had none. */
void labels_settle(
    struct labels *labels, const uint8_t id[PEN_ID_BYTES], const char *name, bool stored);
void labels_forget(struct labels *labels, const uint8_t id[PEN_ID_BYTES]);

/* Changes `label` by a JSON object (a merge patch of name and tags). Errors: PEN_INVALID,
 * PEN_MALFORMED. */
bool label_change(struct label *label, const char *text, size_t bytes, struct pen_error *error);
/* A name, tidied: the last part of a path without the ending of a scene's file; "" when nothing is
 * left of it. */
void label_from_file(const char *path, char name[PEN_LABEL_NAME_BYTES]);
/* Name and tags as a JSON object, malloc'd. */
char *label_json(const struct label *label);
/* Whether its name has `name` in it, whatever the case of ASCII letters, and it has the tag; "": any. */
bool label_fits(const struct label *label, const char *name, const char *tag);
