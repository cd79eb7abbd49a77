/* penumbra(1), of the commands' rows: printed for the build. */
#include "clients/cli/request_args.h"
#include "clients/cli/rows/command.h"
#include "clients/cli/rows/help.h"
#include "clients/cli/rows/parse.h"
#include <ctype.h>
#include <stdlib.h>
#include <string.h>

/* Text for roff: hyphens as they are typed, no line a request. */
static void put(const char *text)
{
    for (bool begins = true; *text; text++) {
        if (begins && (*text == '.' || *text == '\''))
            fputs("\\&", stdout);
        if (*text == '-')
            fputs("\\-", stdout);
        else if (*text == '\\')
            fputs("\\e", stdout);
        else
            putchar(*text);
        begins = *text == '\n';
    }
}

static void put_heading(const char *macro, const char *text)
{
    printf("%s ", macro);
    for (; *text; text++)
        putchar(toupper((unsigned char)*text));
    putchar('\n');
}

static void show(void *context, const struct cli_shown *row)
{
    (void)context;
    puts(".TP");
    fputs("\\fB", stdout);
    put(row->usage);
    fputs("\\fR\n", stdout);
    put(row->help);
    putchar('\n');
}

static void put_command(const struct cli_command *c)
{
    put_heading(".SH", c->name);
    for (const struct cli_action *a = c->actions; a && a->name; a++) {
        puts(".TP");
        printf("\\fBpenumbra %s %s\\fR ", c->name, a->name);
        put(a->words);
        putchar('\n');
        put(a->help);
        putchar('\n');
    }
    if (!c->actions) {
        printf("\\fBpenumbra %s\\fR ", c->name);
        put(c->words);
        puts(" [options]");
    }
    puts(".PP");
    put(c->about ? c->about : c->summary);
    putchar('\n');
    if (c->choices) {
        puts(".PP");
        for (int i = 0; c->choices[i]; i++) {
            put(c->choices[i]);
            puts(c->choices[i + 1] ? "," : ".");
        }
    }
    cli_each_row(c, show, NULL);
    if (!c->requests)
        return;
    puts(".PP\nKeys of \\fB\\-\\-light\\fR:");
    cli_each_light_key(show, NULL);
}

static int run(const struct cli_command *command, struct cli_args *args)
{
    struct cli_common options = {0};
    int status = cli_parse(command, args, &options, NULL);
    if (status != CLI_OK || options.help)
        return status;
    printf(".TH penumbra 1 \"\" \"penumbra %s\"\n.SH NAME\n", PENUMBRA_VERSION);
    puts("penumbra \\- client of the soft\\-shadow render daemon\n.SH SYNOPSIS");
    for (const struct cli_command *const *c = cli_commands; *c; c++) {
        printf("%s\\fBpenumbra %s\\fR ", c == cli_commands ? "" : ".br\n", (*c)->name);
        put((*c)->words);
        puts((*c)->actions ? "" : " [options]");
    }
    puts(".SH DESCRIPTION");
    for (const struct cli_command *const *c = cli_commands; *c; c++) {
        printf(".TP\n\\fB%s\\fR\n", (*c)->name);
        put((*c)->summary);
        puts(".");
    }
    for (const struct cli_command *const *c = cli_commands; *c; c++)
        put_command(*c);
    puts(".SH ENVIRONMENT");
    put(cli_environment);
    puts("\n.SH EXIT STATUS");
    put(cli_exit_status);
    puts("\n.SH EXAMPLES\n.EX");
    put("penumbra generate demo -o demo.glb\n"
        "penumbra render demo.glb -o demo.png --technique pcss\n"
        "penumbra watch demo.glb -o demo.png\n"
        "penumbra compare demo.glb --techniques hard,pcss\n"
        "penumbra sequence demo.glb -o turn.webp --turntable-elevation-deg 20 --width 320 "
        "--height 240\n");
    puts(".EE\n.SH SEE ALSO\n.BR penumbrad (8)");
    return CLI_OK;
}

const struct cli_command cli_manual = {.name = "manual",
    .summary = "prints the page of the manual",
    .words = "",
    .rows = (const struct cli_row[]){{0}},
    .local = true,
    .run = run};
