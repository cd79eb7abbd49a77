/* Render requests from JSON bodies and from query strings. */
#pragma once
#include "protocol/request.h"
#include "protocol/technique_info.h"

/* Reads a request body, RenderRequest of the OpenAPI document. Every default is filled in, every value checked
 * (rows, then pen_request_check). `text` needs no NUL. The scene's id is not part of the body: it
 * is left zero. Two bodies that mean the same give the same bytes in *request. Errors:
 * PEN_TOO_BIG above PEN_MAX_JSON_BYTES, PEN_MALFORMED for malformed or too deeply nested JSON
 * (byte offset in the message), PEN_INVALID with a pointer for an unknown or repeated key, a
 * wrong type, a value out of range, keys that exclude each other. */
bool pen_request_from_json(const char *text, size_t bytes, const struct pen_catalogue *catalogue,
    struct pen_request *request, struct pen_error *error);

struct pen_query_pair {
    const char *key, *value; /* percent-decoded; a NULL value is an empty one */
};

/* The same from a query string. Keys are the paths of the JSON body joined by dots:
 *   technique=pcss  params.search_taps=32 (or search_taps=32)  width=800  camera.eye=2,1,3
 *   camera.orbit.azimuth_deg=30  camera.index=0  light.type=rect  lights.1.position=0,3,0
 *   light.texture.pattern=checker  lights=none  output.layer=depth (or layer=depth)  ground=off
 * A bare name of a parameter of the method works when no key of the request has that name.
 * request=<JSON> is a whole body and excludes every other key.
 * Errors as above; the pointer is that of the same key in a JSON body. */
bool pen_request_from_query(const struct pen_query_pair *pairs, uint32_t count,
    const struct pen_catalogue *catalogue, struct pen_request *request, struct pen_error *error);
