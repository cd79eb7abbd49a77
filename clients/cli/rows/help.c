#include "clients/cli/rows/help.h"
#include "clients/cli/request_args.h"
#include "clients/cli/rows/command.h"
#include <stdlib.h>
#include <string.h>

#define COLUMN 36
#define WIDTH 100

const char cli_environment[] =
    "PENUMBRA_SERVER is the server's address, http://127.0.0.1:8080 where it is not set; "
    "PENUMBRA_TOKEN is sent as a bearer token.";
const char cli_exit_status[] =
    "0 done, 1 a file cannot be read or written, 2 wrong usage, 3 the server refuses (4xx), 4 the "
    "server failed or is busy (5xx), 5 no connection.";

/* From column `at` on, lines broken at WIDTH and begun at `indent`. */
static void print_wrapped(FILE *to, const char *text, size_t at, size_t indent)
{
    while (*text) {
        size_t bytes = strcspn(text, " \n");
        if (at > indent && at + 1 + bytes > WIDTH) {
            fprintf(to, "\n%*s", (int)indent, "");
            at = indent;
        } else if (at > indent) {
            fputc(' ', to);
            at++;
        }
        fprintf(to, "%.*s", (int)bytes, text);
        at += bytes;
        text += bytes;
        if (*text == '\n') {
            fprintf(to, "\n%*s", (int)indent, "");
            at = indent;
        }
        text += *text != 0;
    }
    fputc('\n', to);
}

static void print_pair(const char *left, const char *right)
{
    int bytes = printf("  %-*s", COLUMN - 4, left);
    if (bytes > COLUMN - 2)
        printf("\n%*s", COLUMN, "");
    else
        printf("%*s", COLUMN - bytes, "");
    print_wrapped(stdout, right, COLUMN, COLUMN);
}

static void show(void *context, const struct cli_shown *row)
{
    (void)context;
    print_pair(row->usage, row->help);
}

void cli_print_help(const struct cli_command *command)
{
    for (const struct cli_action *a = command->actions; a && a->name; a++) {
        char *left = cli_format("penumbra %s %s %s", command->name, a->name, a->words);
        printf("%-44s%s", left, strlen(left) > 43 ? "\n" : "");
        if (strlen(left) > 43)
            printf("%44s", "");
        print_wrapped(stdout, a->help, 44, 44);
        free(left);
    }
    if (!command->actions)
        printf("penumbra %s%s%s [options]\n", command->name, *command->words ? " " : "",
            command->words);
    putchar('\n');
    print_wrapped(stdout, command->about ? command->about : command->summary, 0, 0);
    putchar('\n');
    if (command->choices) {
        printf("  %.*s is one of:\n", (int)strcspn(command->words, " "), command->words);
        for (int i = 0; command->choices[i]; i++)
            printf("    %s\n", command->choices[i]);
        putchar('\n');
    }
    cli_each_row(command, show, NULL);
    if (command->requests) {
        puts("\nKeys of --light:");
        cli_each_light_key(show, NULL);
    }
}

void cli_print_overview(FILE *to)
{
    for (const struct cli_command *const *c = cli_commands; *c; c++) {
        char *left =
            cli_format("penumbra %s%s%s", (*c)->name, *(*c)->words ? " " : "", (*c)->words);
        fprintf(to, "%-33s%s\n", left, (*c)->summary);
        free(left);
    }
    fputs("\npenumbra COMMAND --help says more.\n\n", to);
    print_wrapped(to, cli_environment, 0, 0);
    fputs("\nExit status:\n", to);
    print_wrapped(to, cli_exit_status, 0, 0);
}
