/* penumbra: the command-line client of the render daemon. */
#include "clients/cli/output.h"
#include "clients/cli/rows/command.h"
#include "clients/cli/rows/help.h"
#include "clients/cli/rows/parse.h"
#include <curl/curl.h>
#include <signal.h>
#include <string.h>

static int print_version(const struct cli_command *command, struct cli_args *args)
{
    struct cli_common options = {0};
    int status = cli_parse(command, args, &options, NULL);
    if (status == CLI_OK && !options.help)
        puts("penumbra " PENUMBRA_VERSION);
    return status;
}

const struct cli_command cli_version = {.name = "version",
    .summary = "prints the version",
    .words = "",
    .rows = (const struct cli_row[]){{0}},
    .local = true,
    .run = print_version};

static const struct cli_command *find(const char *name)
{
    if (!strcmp(name, "--version"))
        return &cli_version;
    if (!strcmp(name, cli_manual.name))
        return &cli_manual;
    for (const struct cli_command *const *c = cli_commands; *c; c++)
        if (!strcmp(name, (*c)->name))
            return *c;
    return NULL;
}

int main(int argc, char **argv)
{
    const char *name = argc > 1 ? argv[1] : "";
    struct cli_args args = {argv, argc, 2, CLI_OK};
    bool help = !strcmp(name, "help") || !strcmp(name, "--help") || !strcmp(name, "-h");
    const struct cli_command *command = find(help && argc > 2 ? argv[2] : name);
    if (help && command)
        cli_print_help(command);
    else if (help)
        cli_print_overview(stdout);
    if (help)
        return fflush(stdout) ? CLI_FAILED : CLI_OK;
    if (!command) {
        if (*name)
            cli_fail(CLI_USAGE, "There is no command %s.", name);
        cli_print_overview(stderr);
        return CLI_USAGE;
    }
    signal(SIGPIPE, SIG_IGN); /* a reader that leaves shows as a failed write */
    cli_output_guard();
    curl_global_init(CURL_GLOBAL_DEFAULT);
    int status = command->run(command, &args);
    curl_global_cleanup();
    if (fflush(stdout) && status == CLI_OK)
        status = cli_fail(CLI_FAILED, "Standard output cannot be written.");
    return status;
}
