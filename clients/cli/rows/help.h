/* --help. */
#pragma once
#include "clients/cli/rows/rows.h"

void cli_print_help(const struct cli_command *command);
void cli_print_overview(FILE *to);
extern const char cli_environment[], cli_exit_status[]; /* what holds for all, as text */
