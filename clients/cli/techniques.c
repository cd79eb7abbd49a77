#include "clients/cli/http.h"
#include <stdlib.h>
#include <string.h>

static const char help_text[] =
    "penumbra techniques [NAME] [--json]   lists the shadow methods, or explains one\n"
    "\n"
    "  --server URL   default: $PENUMBRA_SERVER or http://127.0.0.1:8080\n"
    "  --retry N      how often a busy server is asked again (4)\n"
    "  -v             prints calls and times\n";

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

int cli_techniques(struct cli_args *args)
{
    struct cli_server server;
    const char *name = NULL;
    bool json = false;
    if (!cli_words(args, &(struct cli_words){"techniques", help_text, &name, 1, &server, &json}))
        return args->status;
    if (name && name[strspn(name, "abcdefghijklmnopqrstuvwxyz0123456789-")])
        return cli_fail(CLI_USAGE, "A method's name has lower-case letters, digits and '-'.");
    struct cli_answer answer;
    char *path = cli_format("/v1/techniques%s%s", name ? "/" : "", name ? name : "");
    struct cli_call call = {.method = "GET", .path = path};
    int status = cli_call(&server, &call, &answer);
    cJSON *root = status == CLI_OK ? cli_answer_object(&answer) : NULL;
    if (status == CLI_OK && !root)
        status = CLI_SERVER;
    if (root && json)
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
