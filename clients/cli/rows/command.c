#include "clients/cli/rows/command.h"
#include "clients/cli/request_args.h"
#include <stdlib.h>

const struct cli_command *const cli_commands[] = {&cli_render, &cli_watch, &cli_compare,
    &cli_sequence, &cli_jobs, &cli_scenes, &cli_techniques, &cli_generate, &cli_completion,
    &cli_version, NULL};

static bool take_retries(struct cli_args *args, void *options, const char *value)
{
    struct cli_common *common = options;
    char *end;
    long retries = strtol(value, &end, 10);
    if (!*value || *end || retries < 0 || retries > 1000)
        return cli_fail(CLI_USAGE, "--retry takes a whole number from 0 to 1000.") == CLI_OK;
    (void)args;
    common->server.retries = (int)retries;
    return true;
}

static bool take_server(struct cli_args *args, void *options, const char *value)
{
    struct cli_common *common = options;
    (void)args;
    snprintf(common->server.base, sizeof common->server.base, "%s", value);
    return true;
}

const struct cli_row cli_server_rows[] = {
    {"server", "URL", "The server; default: $PENUMBRA_SERVER or http://127.0.0.1:8080.",
        .take = take_server},
    {"retry", "N", "How often a busy server is asked again; default: 4.", .take = take_retries},
    {"v", NULL, "Prints calls and times.",
        .offset = offsetof(struct cli_common, server) + offsetof(struct cli_server, verbose)},
    {0},
};
const struct cli_row cli_help_rows[] = {
    {"help", NULL, "Prints this.", .offset = offsetof(struct cli_common, help)},
    {"h", NULL, "The same.", .offset = offsetof(struct cli_common, help)},
    {0},
};

static void show_rows(const struct cli_row *row, cli_show *show, void *context)
{
    for (; row->name; row++) {
        const char *dashes = row->name[1] ? "--" : "-";
        char *usage = cli_format(
            "%s%s%s%s", dashes, row->name, row->value ? " " : "", row->value ? row->value : "");
        show(context, &(struct cli_shown){.name = row->name,
                          .usage = usage,
                          .help = row->help,
                          .flag = !row->value,
                          .choices = row->choices,
                          .offer = row->offer});
        free(usage);
    }
}

void cli_each_row(const struct cli_command *command, cli_show *show, void *context)
{
    show_rows(command->rows, show, context);
    if (command->requests)
        cli_each_request_row(command->requests == CLI_SEQUENCE_REQUEST, show, context);
    if (!command->local)
        show_rows(cli_server_rows, show, context);
    show_rows(cli_help_rows, show, context);
}
