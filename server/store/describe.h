/* What the store tells about a scene or an image: read from its blob once, at import, and again
 * where that was damaged. */
#pragma once
#include "server/store/scene_store.h"

/* The document (pen_scene_json or pen_image_json), malloc'd. Errors: PEN_INVALID for a blob
 * that does not pass psc_open, or that is of another source. */
char *describe_blob(enum store_kind kind, const uint8_t id[PEN_ID_BYTES], int blob_fd,
    uint64_t source_bytes, int64_t stored_unix_s, struct pen_error *error);
/* What is true of a scene now, and may be otherwise later. */
struct store_now {
    bool resident;
    const char *label; /* a JSON object, whose members become the document's; NULL: none */
};
/* The stored document, malloc'd, with what is true of a scene now. Errors: PEN_NOT_FOUND,
 * PEN_UNAVAILABLE. */
char *describe_stored(struct scene_store *store, enum store_kind kind,
    const uint8_t id[PEN_ID_BYTES], const struct store_now *now, struct pen_error *error);
