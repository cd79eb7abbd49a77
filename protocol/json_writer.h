/* Writes JSON text. Numbers are the shortest that read back as the same float or double; strings
 * come out as valid UTF-8 whatever goes in. Running out of memory aborts. */
#pragma once
#include "protocol/param.h"

struct pen_json { /* all zero: ready to write; not thread-safe */
    char *text;
    size_t size, capacity;
    uint64_t arrays; /* bit d: the container at depth d is an array */
    uint64_t filled; /* bit d: it already has an item */
    uint32_t depth;  /* open containers, at most 64 */
};

/* Opens a container. `key` is the member's name inside an object and NULL inside an array or at the
 * top; the same goes for every other writer. */
void pen_json_object(struct pen_json *json, const char *key);
void pen_json_array(struct pen_json *json, const char *key);
/* Closes the innermost open container. */
void pen_json_end(struct pen_json *json);

void pen_json_string(struct pen_json *json, const char *key, const char *text); /* NULL: null */
/* A link to a path of this service. Where that is offered is known to who sends the document: until then
 * PEN_JSON_LINK, which nothing else in a document can be, stands before it. */
#define PEN_JSON_LINK '\x1a'
void pen_json_link(struct pen_json *json, const char *key, const char *path);
/* The document with `prefix` ("", or "/path") before each link; takes the text. */
char *pen_json_put_links(char *text, const char *prefix);
void pen_json_float(struct pen_json *json, const char *key, float value);   /* not finite: null */
void pen_json_double(struct pen_json *json, const char *key, double value); /* not finite: null */
void pen_json_int(struct pen_json *json, const char *key, int64_t value);
void pen_json_uint(struct pen_json *json, const char *key, uint64_t value);
void pen_json_bool(struct pen_json *json, const char *key, bool value);
void pen_json_null(struct pen_json *json, const char *key);
void pen_json_floats(struct pen_json *json, const char *key, const float *values, uint32_t count);
void pen_json_doubles(struct pen_json *json, const char *key, const double *values, uint32_t count);
/* 32 bytes as 64 hexadecimal digits. */
void pen_json_id(struct pen_json *json, const char *key, const uint8_t *id);
/* `text` must be JSON already. */
void pen_json_raw(struct pen_json *json, const char *key, const char *text);
/* The row's value in `object`, under the row's name: a number, a name, a boolean or an array. */
void pen_json_row(struct pen_json *json, const struct pen_param *row, const void *object);
/* The row's default, under `key`. */
void pen_json_row_default(struct pen_json *json, const char *key, const struct pen_param *row);

/* Ends the document: returns the NUL-terminated text (free() it) and its length without the NUL in
 * *bytes, which may be NULL, and zeroes *json. Every container must be closed. */
char *pen_json_finish(struct pen_json *json, size_t *bytes);
/* Throws away what was written. */
void pen_json_discard(struct pen_json *json);
