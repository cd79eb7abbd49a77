#include "clients/cli/http.h"
#include "clients/cli/rows/command.h"
#include "clients/cli/rows/parse.h"
#include <stdlib.h>
#include <string.h>

static const char *text(const cJSON *object, const char *key)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, key);
    return cJSON_IsString(item) ? item->valuestring : "";
}

/* A member as JSON, without white space; the caller frees it. */
static char *member(const cJSON *object, const char *key)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, key);
    char *printed = item ? cJSON_PrintUnformatted(item) : NULL;
    return printed ? printed : cli_format("-");
}

static void print_param(const cJSON *row)
{
    char *standard = member(row, "default"), *range;
    if (cJSON_GetObjectItemCaseSensitive(row, "choices"))
        range = member(row, "choices");
    else if (cJSON_GetObjectItemCaseSensitive(row, "min")) {
        char *min = member(row, "min"), *max = member(row, "max");
        range = cli_format("%s to %s %s", min, max, text(row, "unit"));
        free(min);
        free(max);
    } else
        range = cli_format("true or false");
    printf("  --set %s=%s\n      %s (%s)\n", text(row, "name"), standard, text(row, "help"), range);
    free(standard);
    free(range);
}

static void print_technique(const cJSON *technique)
{
    const cJSON *params = cJSON_GetObjectItemCaseSensitive(technique, "params");
    printf("%s: %s\n%s\n%s\nArtefacts: %s\nCost: %s\n", text(technique, "name"),
        text(technique, "title"), text(technique, "summary"), text(technique, "citation"),
        text(technique, "artefacts"), text(technique, "cost_class"));
    for (const cJSON *row = params ? params->child : NULL; row; row = row->next)
        print_param(row);
}

static void print_list(const cJSON *root)
{
    const cJSON *list = cJSON_GetObjectItemCaseSensitive(root, "techniques");
    for (const cJSON *technique = list ? list->child : NULL; technique; technique = technique->next)
        printf("%-16s %-10s %s\n", text(technique, "name"), text(technique, "cost_class"),
            text(technique, "title"));
}

struct options {
    struct cli_common common;
    bool json;
};

static int run(const struct cli_command *command, struct cli_args *args)
{
    struct options options = {0};
    int status = cli_parse(command, args, &options, NULL);
    if (status != CLI_OK || options.common.help)
        return status;
    const char *name = options.common.words[0];
    if (name && name[strspn(name, "abcdefghijklmnopqrstuvwxyz0123456789-")])
        return cli_fail(CLI_USAGE, "A method's name has lower-case letters, digits and '-'.");
    struct cli_answer answer;
    char *path = cli_format("/v1/techniques%s%s", name ? "/" : "", name ? name : "");
    struct cli_call call = {.method = "GET", .path = path};
    status = cli_call(&options.common.server, &call, &answer);
    cJSON *root = status == CLI_OK ? cli_answer_object(&answer) : NULL;
    if (status == CLI_OK && !root)
        status = CLI_SERVER;
    if (root && options.json)
        puts(answer.text);
    else if (root && name)
        print_technique(root);
    else if (root)
        print_list(root);
    cJSON_Delete(root);
    cli_answer_finish(&answer);
    free(path);
    return status;
}

const struct cli_command cli_techniques = {.name = "techniques",
    .summary = "lists the shadow methods, or explains one",
    .words = "[NAME]",
    .about = "Lists the shadow methods: name, cost class and title; of one, its parameters with "
             "default, "
             "range and help, its citation and what it does wrong.",
    .rows = (const struct cli_row[]){{"json", NULL, "Prints the server's answer.",
                                         .offset = offsetof(struct options, json)},
        {0}},
    .offer = CLI_OFFER_TECHNIQUES,
    .most_words = 1,
    .run = run};
