/* A small picture of each scene, made when somebody first asks for it and kept in the scene's folder,
 * where it counts as part of the scene. */
#pragma once
#include "protocol/request.h"
#include "server/store/scene_store.h"

#define THUMBNAIL_BYTES (1u << 20) /* at most */

/* The render that gives it. */
void thumbnail_request(struct pen_request *request, const uint8_t scene[PEN_ID_BYTES],
    const struct pen_catalogue *catalogue);
/* The image that is kept, malloc'd; NULL: there is none, or it was damaged and is gone. */
char *thumbnail_read(struct scene_store *store, const uint8_t scene[PEN_ID_BYTES], size_t *bytes);
/* Keeps one. Errors: PEN_FULL, PEN_UNAVAILABLE, PEN_NOT_FOUND: it can be made again. */
bool thumbnail_keep(struct scene_store *store, const uint8_t scene[PEN_ID_BYTES], const void *data,
    size_t bytes, struct pen_error *error);
