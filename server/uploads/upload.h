/* An upload on its way into the store: a body is written to a staging folder while it is hashed. A
 * multipart body becomes a bundle (renderer/import/bundle.h), or, when it holds one file that needs
 * no others, that file itself. */
#pragma once
#include "server/store/scene_store.h"

struct upload;
/* `content_type` decides between a raw and a multipart body; `entry` names the scene that is wanted
 * of several, "" when none does; `limit` is in bytes. Errors: PEN_UNAVAILABLE (the store),
 * PEN_UNKNOWN_TYPE. */
struct upload *upload_create(struct scene_store *store, const char *content_type, const char *entry,
    uint64_t limit, struct pen_error *error);
/* Removes what is left of it. */
void upload_destroy(struct upload *upload);
/* Errors: PEN_TOO_BIG, PEN_MALFORMED, PEN_FULL, PEN_UNAVAILABLE. */
bool upload_add(struct upload *upload, const void *data, size_t bytes, struct pen_error *error);
/* The body is over: writes the source file and gives its id. May take a while. */
bool upload_finish(struct upload *upload, uint8_t id[PEN_ID_BYTES], struct pen_error *error);
/* The name of the file that it is, or that says most about it; "": nobody said. */
const char *upload_name(const struct upload *upload);
/* The folder with the finished source; the importer commits or discards it. */
struct store_staging *upload_staging(struct upload *upload);
uint64_t upload_bytes(const struct upload *upload);
