/* Jobs of the server. */
#pragma once
#include "clients/cli/http.h"

/* Waits until a job is over, telling on a terminal how far it is. *job: the server's description of it
 * (free with cJSON_Delete); CLI_SERVER when it has failed, with the reason, CLI_FAILED when it was
 * cancelled. */
int cli_wait_job(const struct cli_server *server, const char *path, cJSON **job);
