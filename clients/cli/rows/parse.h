/* A command's arguments, by its rows. */
#pragma once
#include "clients/cli/rows/rows.h"

/* Reads what is left of the command line. `options` begins with a struct cli_common; `root` is the
 * request, for commands that take one. Returns an enum cli_exit. */
int cli_parse(const struct cli_command *command, struct cli_args *args, void *options, cJSON *root);
