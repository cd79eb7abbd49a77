/* What a client sends behind its header: JSON that is kept, or an upload that goes into the store
 * as it comes. */
#pragma once
#include "protocol/routes.h"
#include "server/routes/context.h"
#include "server/uploads/gunzip.h"
#include "server/uploads/upload.h"

#define ROUTES_BUSY_S 2 /* until another upload may find room */

struct call_body {
    char *text; /* not NUL-terminated */
    size_t text_bytes, capacity;
    struct upload *upload;               /* until a handler takes it over */
    struct gunzip *gunzip;               /* NULL: it comes as it is */
    char name[2 * PEN_LABEL_NAME_BYTES]; /* of an upload, as its query says; "": it does not */
    uint64_t client;                     /* whose it is */
    bool has_place;                      /* holds one of service->places */
    bool unknown_coding;                 /* it was refused for its Content-Encoding */
};

/* At the header, before the body is sent: refuses what the address does not take, and finds an
 * upload a place of body->client's. Errors: PEN_UNKNOWN_TYPE, PEN_TOO_BIG, PEN_TOO_MANY,
 * PEN_UNAVAILABLE. */
bool body_open(struct call_body *body, struct service *service, enum pen_body takes,
    struct http_exchange *exchange, struct pen_error *error);
/* Errors: PEN_TOO_BIG, PEN_MALFORMED, and those of upload_add. */
bool body_add(struct call_body *body, const void *data, size_t bytes, struct pen_error *error);
/* The last byte has come. Errors: PEN_MALFORMED. */
bool body_end(struct call_body *body, struct pen_error *error);
void body_finish(struct call_body *body, struct service *service);
/* The text, "{}" when there is none. */
const char *body_json(const struct call_body *body, size_t *bytes);
