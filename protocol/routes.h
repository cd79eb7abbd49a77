/* The calls of the public listener, one row each: the front end routes by them and the OpenAPI
 * document lists them. */
#pragma once
#include "protocol/limits.h"
#include <stdbool.h>
#include <stdint.h>

enum pen_route_id {
    PEN_ROUTE_SERVICE,      /* GET /v1 */
    PEN_ROUTE_OPENAPI,      /* GET /openapi.json */
    PEN_ROUTE_TECHNIQUES,   /* GET /v1/techniques */
    PEN_ROUTE_TECHNIQUE,    /* GET /v1/techniques/{name} */
    PEN_ROUTE_SCENES,       /* GET /v1/scenes */
    PEN_ROUTE_SCENE_POST,   /* POST /v1/scenes */
    PEN_ROUTE_SCENE,        /* GET /v1/scenes/{id} */
    PEN_ROUTE_SCENE_PUT,    /* PUT /v1/scenes/{id} */
    PEN_ROUTE_SCENE_DELETE, /* DELETE /v1/scenes/{id} */
    PEN_ROUTE_RENDER,       /* GET /v1/scenes/{id}/render */
    PEN_ROUTE_RENDER_POST,  /* POST /v1/scenes/{id}/render */
    PEN_ROUTE_COMPARE,      /* POST /v1/scenes/{id}/compare */
    PEN_ROUTE_IMAGES,       /* GET /v1/images */
    PEN_ROUTE_IMAGE_POST,   /* POST /v1/images */
    PEN_ROUTE_IMAGE,        /* GET /v1/images/{id} */
    PEN_ROUTE_IMAGE_PUT,    /* PUT /v1/images/{id} */
    PEN_ROUTE_IMAGE_DELETE, /* DELETE /v1/images/{id} */
    PEN_ROUTE_STATS,        /* GET /v1/stats */
    PEN_ROUTE_RESULT,       /* GET /v1/results/{id} */
    PEN_ROUTES
};

/* What a body holds. */
enum pen_body {
    PEN_BODY_NONE,
    PEN_BODY_REQUEST,      /* a render request */
    PEN_BODY_COMPARE,      /* what to compare */
    PEN_BODY_SCENE_UPLOAD, /* model/gltf-binary, multipart/form-data, application/zip */
    PEN_BODY_IMAGE_UPLOAD, /* image/png, image/jpeg, image/webp */
    PEN_BODY_IMAGE,        /* a rendered image, or the record when JSON is accepted */
    PEN_BODY_SERVICE,
    PEN_BODY_OPENAPI,
    PEN_BODY_TECHNIQUES,
    PEN_BODY_TECHNIQUE,
    PEN_BODY_SCENES,
    PEN_BODY_SCENE,
    PEN_BODY_IMAGES,
    PEN_BODY_IMAGE_INFO,
    PEN_BODY_STATS,
    PEN_BODY_COMPARISON,
};

enum pen_route_flags {
    PEN_ROUTE_CREATES = 1,     /* 201 for something new, 200 for what is there already */
    PEN_ROUTE_QUERY = 2,       /* takes the render request as a query string */
    PEN_ROUTE_PAGED = 4,       /* takes limit and after */
    PEN_ROUTE_CONDITIONAL = 8, /* ETag and If-None-Match */
};

struct pen_route {
    uint32_t id;         /* enum pen_route_id; the row's index */
    const char *method;  /* "GET" also serves HEAD */
    const char *pattern; /* "{id}" is 64 lower-case hexadecimal digits, "{name}" a method's name */
    const char *operation;
    const char *summary;
    uint8_t takes, gives; /* enum pen_body */
    uint8_t flags;        /* enum pen_route_flags */
};
extern const struct pen_route pen_routes[PEN_ROUTES];

struct pen_route_match {
    const struct pen_route *route;       /* NULL: none */
    char id[PEN_ID_HEX + 1];             /* what stood for {id}, or "" */
    char name[PEN_TECHNIQUE_NAME_BYTES]; /* what stood for {name}, or "" */
    uint32_t methods;                    /* bit r: row r has this path, whatever its method */
};

/* Finds the row for a method and a decoded path without its query, token by token; nothing is
 * normalised ("//", "/." and a trailing slash match no row). Returns true when match->route is set.
 * When it is not, match->methods says whether the path exists (405, Allow) or not (404). */
bool pen_route_find(const char *method, const char *path, struct pen_route_match *match);
/* "GET, HEAD, POST": the Allow header for match->methods. */
void pen_route_allow(uint32_t methods, char *text, uint32_t bytes);
