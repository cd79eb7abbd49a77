/* Files that are written: beside their place at first, as FILE.part, so that what is there is whole
 * or what was there before; nothing is left of it when the program is interrupted. */
#pragma once
#include "clients/cli/cli.h"

struct cli_output {
    FILE *file; /* to be written to; NULL: reported already */
    char *part; /* NULL: standard output */
    const char *path;
};
/* "-": standard output. Returns an enum cli_exit, CLI_FAILED with the reason. */
int cli_output_open(struct cli_output *output, const char *path);
/* Ends it: with `status` CLI_OK the file takes its place, else nothing is left. Returns `status`, or
 * CLI_FAILED with the reason. */
int cli_output_end(struct cli_output *output, int status);
/* Makes a folder unless it is there. */
int cli_output_folder(const char *path);
/* From now on an interrupt removes what is half written, and ends the program as it would. */
void cli_output_guard(void);
/* Why `path` cannot be had, by errno: "x cannot be read: it is a folder". Returns CLI_FAILED. */
int cli_output_fail(const char *path, const char *verb);
