/* The schemas of the OpenAPI document. */
#pragma once
#include "protocol/json_writer.h"
#include "protocol/technique_info.h"

/* Writes the members of "schemas" into the open object. */
void pen_openapi_schemas(struct pen_json *json, const struct pen_catalogue *catalogue);
