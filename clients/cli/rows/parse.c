#include "clients/cli/rows/parse.h"
#include "clients/cli/request_args.h"
#include "clients/cli/rows/command.h"
#include "clients/cli/rows/help.h"

/* Consumes the current argument when it is one of the rows. */
static bool take_row(struct cli_args *args, const struct cli_row *row, void *options)
{
    const char *value = NULL;
    for (; row->name; row++) {
        if (!(row->value ? cli_option(args, row->name, &value) : cli_flag(args, row->name)))
            continue;
        if (args->status != CLI_OK)
            return true;
        if (row->take && !row->take(args, options, value))
            args->status = args->status ? args->status : CLI_USAGE;
        else if (!row->take && row->value)
            *(const char **)((char *)options + row->offset) = value;
        else if (!row->take)
            *(bool *)((char *)options + row->offset) = true;
        return true;
    }
    return false;
}

int cli_parse(const struct cli_command *command, struct cli_args *args, void *options, cJSON *root)
{
    struct cli_common *common = options;
    const char *word;
    cli_server_init(&common->server);
    while (args->at < args->count && args->status == CLI_OK) {
        if (take_row(args, command->rows, options) || take_row(args, cli_help_rows, options) ||
            (!command->local && take_row(args, cli_server_rows, options)))
            continue;
        if (command->requests == CLI_RENDER_REQUEST
                ? cli_request_option(args, root)
                : command->requests == CLI_SEQUENCE_REQUEST && cli_sequence_option(args, root))
            continue;
        if (common->count < command->most_words && (word = cli_positional(args)))
            common->words[common->count++] = word;
        else
            args->status = cli_unknown(args, command->name);
    }
    if (args->status == CLI_OK && common->help)
        cli_print_help(command);
    return args->status;
}
