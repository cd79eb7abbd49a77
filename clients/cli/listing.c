#include "clients/cli/listing.h"
#include <stdlib.h>
#include <string.h>

double cli_number(const cJSON *object, const char *key)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, key);
    return cJSON_IsNumber(item) ? item->valuedouble : 0;
}

const char *cli_text(const cJSON *object, const char *key)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, key);
    return cJSON_IsString(item) ? item->valuestring : "";
}

static void print_json(const cJSON *object)
{
    char *printed = cJSON_Print(object);
    puts(printed ? printed : "");
    free(printed);
}

/* One page; *next is the path of the one after it, or NULL. */
static int list_page(const struct cli_server *server, const char *path, const char *key, bool json,
    void (*print)(const cJSON *item), char **next)
{
    struct cli_answer answer;
    struct cli_call call = {.method = "GET", .path = path};
    int status = cli_call(server, &call, &answer);
    cJSON *page = status == CLI_OK ? cli_answer_object(&answer) : NULL;
    const cJSON *items = cJSON_GetObjectItemCaseSensitive(page, key);
    *next = NULL;
    if (status == CLI_OK && !page)
        status = CLI_SERVER;
    if (json && page)
        print_json(page);
    for (const cJSON *item = !json && items ? items->child : NULL; item; item = item->next)
        print(item);
    const char *after = cli_text(page, "next");
    if (after[0] == '/')
        *next = cli_format("%s", after);
    else if (cli_is_id(after))
        *next = cli_format("%.*s?after=%s", (int)strcspn(path, "?"), path, after);
    cJSON_Delete(page);
    cli_answer_finish(&answer);
    return status;
}

int cli_list(const struct cli_server *server, const char *start, const char *key, bool json,
    void (*print)(const cJSON *item))
{
    char *path = cli_format("%s", start), *next;
    int status;
    do {
        status = list_page(server, path, key, json, print, &next);
        free(path);
        path = next;
    } while (status == CLI_OK && path);
    free(path);
    return status;
}

int cli_with_id(
    const struct cli_server *server, const char *method, const char *folder, const char *id)
{
    struct cli_answer answer;
    char *path = cli_format("%s/%s", folder, id);
    struct cli_call call = {.method = method, .path = path};
    int status = cli_call(server, &call, &answer);
    cJSON *object = NULL;
    if (status == CLI_OK && (answer.bytes || !strcmp(method, "GET"))) {
        object = cli_answer_object(&answer);
        status = object ? CLI_OK : CLI_SERVER;
    }
    if (object)
        print_json(object);
    cJSON_Delete(object);
    cli_answer_finish(&answer);
    free(path);
    return status;
}
