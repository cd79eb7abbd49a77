/* Stored scenes and jobs, by what people call them. */
#pragma once
#include "clients/cli/http.h"
#include "protocol/limits.h"

/* Finds the stored scene that `name` means: an id, its first digits, or its name. Returns an enum
 * cli_exit; CLI_USAGE when there is none, or several. */
int cli_find_scene(const struct cli_server *server, const char *name, char id[PEN_ID_HEX + 1]);
