/* Small files of a stored entry's folder that carry their own checksum, a line before what they
 * hold: what is derived from an entry, or said of it, and may be lost without it. */
#pragma once
#include "server/store/scene_store.h"

/* What the file holds, malloc'd, at most `most` bytes, with a NUL behind. NULL: it is not there, or
 * *damaged (not NULL). */
char *sealed_read(int folder, const char *name, size_t most, size_t *bytes, bool *damaged);
/* Puts a file in place of the one of this name; `sync`: it outlives a loss of power. Errors:
 * PEN_UNAVAILABLE, PEN_FULL. */
bool sealed_write(int folder, const char *name, const void *data, size_t bytes, bool sync,
    struct pen_error *error);
/* How many bytes the file then has. */
size_t sealed_bytes(size_t bytes);
