/* What each address does: one handler per row of endpoints.def, called when the whole request is
 * there. It answers, or has the call wait and be resumed; false, with the error filled, answers
 * with a problem document. A row without its handler does not link. */
#pragma once
#include "server/routes/call.h"

extern const struct http_callbacks routes_callbacks, routes_admin_callbacks;

#define ENDPOINT(id, ...) bool route_##id(struct call *call, struct pen_error *error);
#include "protocol/endpoints.def"
#undef ENDPOINT

/* Everything that a request refers to must be in the store. */
bool routes_check_store(
    struct call *call, const struct pen_request *request, struct pen_error *error);
