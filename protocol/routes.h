/* The calls of the public listener, as endpoints.def lists them. */
#pragma once
#include "protocol/limits.h"
#include <stdbool.h>
#include <stdint.h>

enum pen_route_id {
#define ENDPOINT(id, ...) PEN_ROUTE_##id,
#include "protocol/endpoints.def"
#undef ENDPOINT
    PEN_ROUTES
};

/* What a body holds: one of the documents in schemas.def, or something else. */
enum pen_body {
    PEN_BODY_NONE,
#define DERIVED(name, writer) PEN_BODY_##name,
#define WRITTEN(name) PEN_BODY_##name,
#include "protocol/schemas.def"
#undef WRITTEN
#undef DERIVED
    PEN_BODY_SCENE_UPLOAD,
    PEN_BODY_IMAGE_UPLOAD,
    PEN_BODY_PICTURE,   /* an image */
    PEN_BODY_RENDERED,  /* a rendered image, its record, or either as it gets better */
    PEN_BODY_THUMBNAIL, /* a small JPEG */
    PEN_BODY_PAGE,      /* HTML */
    PEN_BODY_MODULE,    /* JavaScript */
    PEN_BODY_ASSET,     /* JavaScript or CSS */
    PEN_BODY_COMPARED,  /* a comparison, or its rows as they are measured */
    PEN_BODY_EVENTS,    /* what becomes of a job */
    PEN_BODY_LIVE,      /* what the service counts */
    PEN_BODY_FRAME,     /* an image, or the request that gives it */
    PEN_BODY_RESULT,    /* all that a job gives */
};
/* The media types of an upload, ended by NULL; NULL: the body is no upload. */
const char *const *pen_upload_types(enum pen_body body);

enum pen_route_flags {
    PEN_ROUTE_CREATES = 1,     /* 201 for something new, 200 for what is there already */
    PEN_ROUTE_QUERY = 2,       /* takes the render request as a query string */
    PEN_ROUTE_PAGED = 4,       /* takes limit and after */
    PEN_ROUTE_CONDITIONAL = 8, /* ETag and If-None-Match */
    PEN_ROUTE_OPEN = 16,       /* asks for no token */
    PEN_ROUTE_ENTRY = 32,      /* takes entry, the scene that is wanted of several, and its name */
    PEN_ROUTE_NAMED = 64,      /* a scene file's name may follow, which says nothing more */
    PEN_ROUTE_ASYNC = 128,     /* Prefer: respond-async makes it a job */
    PEN_ROUTE_JOB = 256,       /* always makes a job */
    PEN_ROUTE_RANGES = 512,    /* Range */
    PEN_ROUTE_REMOVES = 1024,  /* 204 where nothing is left of it */
    PEN_ROUTE_STATES = 2048,   /* takes state */
    PEN_ROUTE_KEYED = 4096,    /* takes Idempotency-Key */
    PEN_ROUTE_LABELS = 8192,   /* takes name and tag, of what is wanted */
};

struct pen_route {
    uint32_t id;        /* enum pen_route_id; the row's index */
    const char *method; /* "GET" also serves HEAD */
    const char *
        pattern; /* "{id}" is an id or at least its first PEN_ID_PREFIX digits, "{name}" a method's name,
                            "{file}" a file's, "{number}" a whole number */
    const char *operation;
    const char *summary;
    uint8_t takes, gives; /* enum pen_body */
    uint16_t flags;       /* enum pen_route_flags */
};
extern const struct pen_route pen_routes[PEN_ROUTES];

struct pen_route_match {
    const struct pen_route *route;       /* NULL: none */
    uint8_t id[PEN_ID_BYTES];            /* what stood for {id}, zeros behind its digits */
    uint32_t id_digits;                  /* how many it had; PEN_ID_HEX: all */
    char name[PEN_TECHNIQUE_NAME_BYTES]; /* what stood for {name} or {file}, or "" */
    uint32_t number;                     /* what stood for {number} */
    uint64_t methods;                    /* bit r: row r has this path, whatever its method */
};

/* Finds the row for a method and a decoded path without its query, token by token; nothing is
 * normalised ("//", "/." and a trailing slash match no row). Returns true when match->route is set.
 * When it is not, match->methods says whether the path exists (405, Allow) or not (404). */
bool pen_route_find(const char *method, const char *path, struct pen_route_match *match);
/* "GET, HEAD, POST": the Allow header for match->methods. */
void pen_route_allow(uint64_t methods, char *text, uint32_t bytes);
