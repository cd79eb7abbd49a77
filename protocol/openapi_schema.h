/* The schemas of the OpenAPI document. */
#pragma once
#include "protocol/json_writer.h"
#include "protocol/technique_info.h"

/* The schema of a row's value, as member `key`, or as an item of an array (NULL). Generators of clients
 * do not follow references into the properties of another schema, so rows are written where they are
 * used. */
void pen_openapi_row(struct pen_json *json, const char *key, const struct pen_param *row);
/* Writes the members of "schemas" into the open object. */
void pen_openapi_schemas(struct pen_json *json, const struct pen_catalogue *catalogue);
