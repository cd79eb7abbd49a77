/* Shared by the readers of requests; nothing else includes cJSON's tree. */
#pragma once
#include "protocol/request.h"
#include "protocol/technique_info.h"
#include <cjson/cJSON.h>

/* Reads a tree of the shape of a request body. text: leaves are strings in the notation of
 * pen_param_parse. Errors: PEN_INVALID with a pointer. */
bool pen_request_from_tree(const cJSON *root, bool text, const struct pen_catalogue *catalogue,
    struct pen_request *request, struct pen_error *error);
/* Reads an object whose keys are all rows of `table`, into `object`, which holds their defaults. The
 * object stands at `pointer`. Errors: PEN_INVALID with a pointer. */
bool pen_rows_from_tree(const cJSON *node, struct pen_param_table table, void *object,
    const char *pointer, struct pen_error *error);
