#include "clients/cli/which.h"
#include "clients/cli/listing.h"
#include <curl/curl.h>
#include <stdlib.h>
#include <string.h>

static int find_prefix(
    const struct cli_server *server, const char *digits, char id[PEN_ID_HEX + 1], bool *found)
{
    struct cli_answer answer;
    char *path = cli_format("/v1/scenes/%s", digits);
    struct cli_call call = {.method = "GET", .path = path, .missing_is_ok = true};
    int status = cli_call(server, &call, &answer);
    *found = status == CLI_OK && answer.status != 404;
    cJSON *scene = *found ? cli_answer_object(&answer) : NULL;
    const char *whole = cli_text(scene, "id");
    if (*found && !cli_is_id(whole))
        status = cli_fail(CLI_SERVER, "The server's answer has no id.");
    else if (*found)
        memcpy(id, whole, PEN_ID_HEX + 1);
    cJSON_Delete(scene);
    cli_answer_finish(&answer);
    free(path);
    return status;
}

/* One page; the names of those that are meant are collected in *matches, the first one in id. */
static int match_page(const struct cli_server *server, char **path, const char *name,
    char id[PEN_ID_HEX + 1], char **matches)
{
    struct cli_answer answer;
    struct cli_call call = {.method = "GET", .path = *path};
    int status = cli_call(server, &call, &answer);
    cJSON *page = status == CLI_OK ? cli_answer_object(&answer) : NULL;
    const cJSON *list = cJSON_GetObjectItemCaseSensitive(page, "scenes");
    for (const cJSON *item = list ? list->child : NULL; item; item = item->next) {
        const char *whole = cli_text(item, "id");
        if (strcmp(cli_text(item, "name"), name) || !cli_is_id(whole))
            continue;
        char *longer = cli_format("%s%s%.12s", *matches, **matches ? ", " : "", whole);
        if (!**matches)
            memcpy(id, whole, PEN_ID_HEX + 1);
        free(*matches);
        *matches = longer;
    }
    free(*path);
    const char *next = cli_text(page, "next");
    *path = *next == '/' ? cli_format("%s", next) : NULL;
    cJSON_Delete(page);
    cli_answer_finish(&answer);
    return status == CLI_OK && !page ? CLI_SERVER : status;
}

static int find_name(const struct cli_server *server, const char *name, char id[PEN_ID_HEX + 1])
{
    char *escaped = curl_easy_escape(NULL, name, 0), *matches = cli_format("%s", "");
    char *path = cli_format("/v1/scenes?limit=200&name=%s", escaped ? escaped : "");
    int status = CLI_OK;
    while (status == CLI_OK && path)
        status = match_page(server, &path, name, id, &matches);
    if (status == CLI_OK && !*matches)
        status = cli_fail(CLI_USAGE,
            "%s is no file here, and no scene of the server: neither an id (nor at least %d of its "
            "first digits) nor a name. See penumbra scenes.",
            name, PEN_ID_PREFIX);
    else if (status == CLI_OK && strchr(matches, ','))
        status = cli_fail(CLI_USAGE, "Several scenes are called %s: %s.", name, matches);
    free(matches);
    free(path);
    curl_free(escaped);
    return status;
}

int cli_find_scene(const struct cli_server *server, const char *name, char id[PEN_ID_HEX + 1])
{
    bool found = false;
    if (cli_is_id(name)) { /* whether it is there shows when it is used */
        memcpy(id, name, PEN_ID_HEX + 1);
        return CLI_OK;
    }
    int status = cli_is_prefix(name) ? find_prefix(server, name, id, &found) : CLI_OK;
    return status != CLI_OK || found ? status : find_name(server, name, id);
}
