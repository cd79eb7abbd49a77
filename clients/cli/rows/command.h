/* All commands, and the rows that they have in common. */
#pragma once
#include "clients/cli/rows/rows.h"

extern const struct cli_command cli_render, cli_watch, cli_compare, cli_sequence, cli_jobs,
    cli_scenes, cli_techniques, cli_generate, cli_completion, cli_manual, cli_version;
/* All that are told of, in that order; NULL behind the last. */
extern const struct cli_command *const cli_commands[];

/* What those that talk to a server take, and what all take. */
extern const struct cli_row cli_server_rows[], cli_help_rows[];

/* Every option of a command, its own first. */
void cli_each_row(const struct cli_command *command, cli_show *show, void *context);
