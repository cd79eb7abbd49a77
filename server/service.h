/* The life of the daemon's parts. */
#pragma once
#include "server/routes/context.h"

/* Opens the store, starts the workers and the listeners. Errors: what the parts say. */
struct service *service_create(
    const struct config *config, const struct pen_catalogue *catalogue, struct pen_error *error);
/* Reads the token file and the certificate again; what is wrong with them is logged, and all stays as
 * it was. */
void service_reload(struct service *service);
/* Answers every accepted request, within the drain timeout or until `hurry` (atomic) is set, and
 * stops everything. */
void service_destroy(struct service *service, const bool *hurry);
