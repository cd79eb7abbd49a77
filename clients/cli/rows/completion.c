/* Completion for shells, of the commands' rows. */
#include "clients/cli/rows/command.h"
#include "clients/cli/rows/parse.h"
#include <stdlib.h>
#include <string.h>

static const char *const shells[] = {"bash", "zsh", "fish", NULL};

/* What a shell runs for what only the server knows; silent where there is none. */
static const char *words_of(enum cli_offer offer)
{
    return offer == CLI_OFFER_TECHNIQUES ? "penumbra techniques 2>/dev/null | cut -d' ' -f1"
           : offer == CLI_OFFER_SCENES   ? "penumbra scenes 2>/dev/null | cut -c1-12"
           : offer == CLI_OFFER_JOBS     ? "penumbra jobs 2>/dev/null | cut -d' ' -f1"
                                         : NULL;
}

/* In single quotes; `fish` escapes otherwise than POSIX. */
static void put_quoted(const char *text, bool fish)
{
    putchar('\'');
    for (; *text; text++) {
        if (*text == '\'')
            fputs(fish ? "\\'" : "'\\''", stdout);
        else if (fish && *text == '\\')
            fputs("\\\\", stdout);
        else
            putchar(*text == '\n' ? ' ' : *text);
    }
    putchar('\'');
}

static const char *dashes(const struct cli_shown *row)
{
    return row->name[1] ? "--" : "-";
}

/* ---- bash ---- */

static void bash_option(void *context, const struct cli_shown *row)
{
    (void)context;
    printf(" %s%s", dashes(row), row->name);
    if (row->negatable)
        printf(" --no-%s", row->name);
}

static void bash_values(void *context, const struct cli_shown *row)
{
    const char *command = context, *words = words_of(row->offer);
    if (row->flag)
        return;
    printf("    %s:%s%s) ", command, dashes(row), row->name);
    if (row->choices || row->word) {
        printf("words='");
        for (int i = 0; row->choices && row->choices[i]; i++)
            printf("%s ", row->choices[i]);
        printf("%s' ", row->word ? row->word : "");
    } else if (words) {
        printf("words=$(%s) ", words);
    }
    puts(row->offer == CLI_OFFER_FILES || row->offer == CLI_OFFER_SCENES ? "files=1 ;;"
         : row->offer == CLI_OFFER_FOLDERS                               ? "files=2 ;;"
                                                                         : ";;");
}

static void bash_offer(enum cli_offer offer)
{
    if (words_of(offer))
        printf("words=$(%s) ", words_of(offer));
    puts(offer == CLI_OFFER_FILES || offer == CLI_OFFER_SCENES ? "files=1 ;;" : ";;");
}

static void print_bash(void)
{
    puts("# bash completion of penumbra; made by: penumbra completion bash\n"
         "_penumbra()\n{\n"
         "    local current=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]}\n"
         "    local command=${COMP_WORDS[1]} words= files= options=");
    printf("    if ((COMP_CWORD == 1)); then\n        COMPREPLY=($(compgen -W 'help");
    for (const struct cli_command *const *c = cli_commands; *c; c++)
        printf(" %s", (*c)->name);
    puts("' -- \"$current\"))\n        return\n    fi\n    case $command in");
    for (const struct cli_command *const *c = cli_commands; *c; c++) {
        printf("    %s) options='", (*c)->name);
        cli_each_row(*c, bash_option, NULL);
        puts("' ;;");
    }
    puts("    esac\n    case $command:$before in");
    for (const struct cli_command *const *c = cli_commands; *c; c++)
        cli_each_row(*c, bash_values, (void *)(*c)->name);
    puts("    *)\n"
         "        if [[ $current == -* ]]; then\n"
         "            COMPREPLY=($(compgen -W \"$options\" -- \"$current\"))\n"
         "            return\n"
         "        fi\n"
         "        case $command:$COMP_CWORD:${COMP_WORDS[2]} in");
    for (const struct cli_command *const *c = cli_commands; *c; c++) {
        if ((*c)->actions || (*c)->choices) {
            printf("        %s:2:*) words='", (*c)->name);
            for (const struct cli_action *a = (*c)->actions; a && a->name; a++)
                printf("%s ", a->name);
            for (int i = 0; (*c)->choices && (*c)->choices[i]; i++)
                printf("%s ", (*c)->choices[i]);
            puts("' ;;");
        }
        for (const struct cli_action *a = (*c)->actions; a && a->name; a++) {
            if (!a->offer)
                continue;
            printf("        %s:3:%s) ", (*c)->name, a->name);
            bash_offer(a->offer);
        }
        if ((*c)->offer) {
            printf("        %s:*) ", (*c)->name);
            bash_offer((*c)->offer);
        }
    }
    puts("        esac ;;\n    esac\n"
         "    COMPREPLY=($(compgen -W \"$words\" -- \"$current\"))\n"
         "    case $files in\n"
         "    1) compopt -o filenames 2>/dev/null; COMPREPLY+=($(compgen -f -- \"$current\")) ;;\n"
         "    2) compopt -o filenames 2>/dev/null; COMPREPLY+=($(compgen -d -- \"$current\")) ;;\n"
         "    esac\n}\ncomplete -F _penumbra penumbra");
}

/* ---- fish ---- */

static void fish_offer(enum cli_offer offer)
{
    if (offer == CLI_OFFER_FILES || offer == CLI_OFFER_SCENES || offer == CLI_OFFER_FOLDERS)
        printf(" -F");
    if (words_of(offer)) {
        printf(" -a '(%s",
            offer == CLI_OFFER_SCENES ? "penumbra scenes 2>/dev/null | cut -c1-12" : "");
        for (const char *c = offer == CLI_OFFER_SCENES ? "" : words_of(offer); *c; c++)
            fputs(*c == '\'' ? "\\'" : (char[]){*c, 0}, stdout);
        printf(")'");
    }
}

static void fish_row(void *context, const struct cli_shown *row)
{
    const char *command = context;
    printf("complete -c penumbra -n '__fish_seen_subcommand_from %s' -%c %s", command,
        row->name[1] ? 'l' : 's', row->name);
    if (!row->flag)
        printf(" -r");
    if (!row->flag && row->choices) {
        printf(" -f -a '");
        for (int i = 0; row->choices[i]; i++)
            printf("%s ", row->choices[i]);
        printf("%s'", row->word ? row->word : "");
    } else if (!row->flag) {
        fish_offer(row->offer);
    }
    printf(" -d ");
    put_quoted(row->help, true);
    putchar('\n');
    if (row->negatable)
        printf("complete -c penumbra -n '__fish_seen_subcommand_from %s' -l no-%s\n", command,
            row->name);
}

static void print_fish(void)
{
    puts("# fish completion of penumbra; made by: penumbra completion fish");
    for (const struct cli_command *const *c = cli_commands; *c; c++) {
        const char *name = (*c)->name;
        printf("complete -c penumbra -n __fish_use_subcommand -f -a %s -d ", name);
        put_quoted((*c)->summary, true);
        putchar('\n');
        for (const struct cli_action *a = (*c)->actions; a && a->name; a++) {
            printf("complete -c penumbra -n '__fish_seen_subcommand_from %s' -f -a %s -d ", name,
                a->name);
            put_quoted(a->help, true);
            putchar('\n');
        }
        for (int i = 0; (*c)->choices && (*c)->choices[i]; i++)
            printf("complete -c penumbra -n '__fish_seen_subcommand_from %s' -f -a %s\n", name,
                (*c)->choices[i]);
        if ((*c)->offer) {
            printf("complete -c penumbra -n '__fish_seen_subcommand_from %s'", name);
            fish_offer((*c)->offer);
            putchar('\n');
        }
        cli_each_row(*c, fish_row, (void *)name);
    }
}

/* ---- zsh ---- */

/* Inside a specification of _arguments. */
static void zsh_text(const char *text)
{
    for (; *text; text++) {
        if (strchr("[]:\\", *text))
            putchar('\\');
        fputs(*text == '\'' ? "'\\''" : *text == '\n' ? " " : (char[]){*text, 0}, stdout);
    }
}

static void zsh_offer(enum cli_offer offer)
{
    if (offer == CLI_OFFER_FILES)
        printf("_files");
    else if (offer == CLI_OFFER_FOLDERS)
        printf("_files -/");
    else if (offer == CLI_OFFER_SCENES)
        printf("_penumbra_scenes");
    else if (words_of(offer))
        printf("_penumbra_%s", offer == CLI_OFFER_JOBS ? "jobs" : "techniques");
}

static void zsh_row(void *context, const struct cli_shown *row)
{
    (void)context;
    printf(" \\\n        '%s%s%s[", dashes(row), row->name,
        row->flag      ? ""
        : row->name[1] ? "="
                       : "+");
    zsh_text(row->help);
    printf("]");
    if (!row->flag) {
        printf(":value:");
        if (row->choices) {
            printf("(");
            for (int i = 0; row->choices[i]; i++)
                printf("%s%s", i ? " " : "", row->choices[i]);
            printf(")");
        } else {
            zsh_offer(row->offer);
        }
    }
    printf("'");
    if (row->negatable)
        printf(" \\\n        '--no-%s'", row->name);
}

static void print_zsh(void)
{
    puts("#compdef penumbra\n# zsh completion of penumbra; made by: penumbra completion zsh");
    static const struct {
        const char *name;
        enum cli_offer offer;
    } lists[] = {{"techniques", CLI_OFFER_TECHNIQUES}, {"jobs", CLI_OFFER_JOBS},
        {"scenes", CLI_OFFER_SCENES}};
    for (size_t i = 0; i < sizeof lists / sizeof *lists; i++)
        printf("_penumbra_%s() { compadd -- ${(f)\"$(%s)\"}%s }\n", lists[i].name,
            words_of(lists[i].offer), lists[i].offer == CLI_OFFER_SCENES ? "; _files" : "");
    puts("_penumbra() {\n    local context state line\n    local -a commands=(");
    for (const struct cli_command *const *c = cli_commands; *c; c++) {
        printf("        '%s:", (*c)->name);
        zsh_text((*c)->summary);
        puts("'");
    }
    puts("    )\n"
         "    if ((CURRENT == 2)); then\n        _describe command commands\n        return\n    "
         "fi\n"
         "    local command=$words[2]\n    shift words\n    ((CURRENT--))\n    case $command in");
    for (const struct cli_command *const *c = cli_commands; *c; c++) {
        printf("    %s) _arguments -s", (*c)->name);
        cli_each_row(*c, zsh_row, NULL);
        if ((*c)->actions || (*c)->choices) {
            printf(" \\\n        '1:what:(");
            for (const struct cli_action *a = (*c)->actions; a && a->name; a++)
                printf("%s ", a->name);
            for (int i = 0; (*c)->choices && (*c)->choices[i]; i++)
                printf("%s ", (*c)->choices[i]);
            printf(")'");
            enum cli_offer offer = (*c)->actions ? (*c)->actions[1].offer : CLI_OFFER_NOTHING;
            if (offer) {
                printf(" \\\n        '2:which:");
                zsh_offer(offer);
                printf("'");
            }
        } else if ((*c)->offer) {
            printf(" \\\n        '1:which:");
            zsh_offer((*c)->offer);
            printf("'");
        }
        puts(" ;;");
    }
    puts("    esac\n}\n_penumbra \"$@\"");
}

static int run(const struct cli_command *command, struct cli_args *args)
{
    struct cli_common options = {0};
    int status = cli_parse(command, args, &options, NULL);
    if (status != CLI_OK || options.help)
        return status;
    int shell = -1;
    for (int i = 0; options.count && shells[i]; i++)
        if (!strcmp(options.words[0], shells[i]))
            shell = i;
    if (shell < 0)
        return cli_fail(CLI_USAGE, "For which shell? bash, zsh or fish.");
    (shell == 0 ? print_bash : shell == 1 ? print_zsh : print_fish)();
    return CLI_OK;
}

const struct cli_command cli_completion = {.name = "completion",
    .summary = "prints completion for a shell: bash, zsh or fish",
    .words = "SHELL",
    .about =
        "Prints what completes penumbra's command lines: source <(penumbra completion bash) in "
        "bash, penumbra completion fish | source in fish, and for zsh in a file _penumbra of a "
        "folder of $fpath. Installed, it is there already. Methods, scenes and jobs are asked "
        "of the server.",
    .rows = (const struct cli_row[]){{0}},
    .choices = shells,
    .local = true,
    .most_words = 1,
    .run = run};
