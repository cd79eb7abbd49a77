/* The OpenAPI document, made from the parameter rows and the routes. */
#pragma once
#include "protocol/technique_info.h"

/* OpenAPI 3.1. Every row appears once, as a schema; query parameters refer to it.
 * The caller frees the text. */
char *pen_openapi_json(const struct pen_catalogue *catalogue, const char *version);
