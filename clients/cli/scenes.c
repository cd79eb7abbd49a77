#include "clients/cli/upload.h"
#include <stdlib.h>
#include <string.h>

static const char help_text[] =
    "penumbra scenes [list [--json]]      lists the stored scenes\n"
    "penumbra scenes show ID              what a scene holds, as JSON\n"
    "penumbra scenes upload FILE          uploads a .glb, .gltf or .zip and prints its id\n"
    "penumbra scenes delete ID            removes a scene\n"
    "\n"
    "  --server URL   default: $PENUMBRA_SERVER or http://127.0.0.1:8080\n"
    "  --retry N      how often a busy server is asked again (4)\n"
    "  -v             prints calls and times\n";

static double number(const cJSON *object, const char *key)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, key);
    return cJSON_IsNumber(item) ? item->valuedouble : 0;
}

static const char *text(const cJSON *object, const char *key)
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
static int list_page(const struct cli_server *server, const char *path, bool json, char **next)
{
    struct cli_answer answer;
    struct cli_call call = {.method = "GET", .path = path};
    int status = cli_call(server, &call, &answer);
    cJSON *page = status == CLI_OK ? cli_answer_object(&answer) : NULL;
    const cJSON *scenes = cJSON_GetObjectItemCaseSensitive(page, "scenes");
    *next = NULL;
    if (status == CLI_OK && !page)
        status = CLI_SERVER;
    if (json && page)
        print_json(page);
    for (const cJSON *scene = !json && scenes ? scenes->child : NULL; scene; scene = scene->next)
        printf("%s %10.0f triangles %8.1f MB  %s\n", text(scene, "id"), number(scene, "triangles"),
            number(scene, "stored_bytes") / 1e6, text(scene, "stored_at"));
    const char *after = text(page, "next");
    if (after[0] == '/')
        *next = cli_format("%s", after);
    else if (cli_is_id(after))
        *next = cli_format("/v1/scenes?after=%s", after);
    cJSON_Delete(page);
    cli_answer_finish(&answer);
    return status;
}

static int list(const struct cli_server *server, bool json)
{
    char *path = cli_format("/v1/scenes"), *next;
    int status;
    do {
        status = list_page(server, path, json, &next);
        free(path);
        path = next;
    } while (status == CLI_OK && path);
    free(path);
    return status;
}

static int with_id(const struct cli_server *server, const char *method, const char *id)
{
    struct cli_answer answer;
    char *path = cli_format("/v1/scenes/%s", id);
    struct cli_call call = {.method = method, .path = path};
    int status = cli_call(server, &call, &answer);
    cJSON *object = NULL;
    if (status == CLI_OK && !strcmp(method, "GET")) {
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

static int upload(const struct cli_server *server, const char *path)
{
    char id[PEN_ID_HEX + 1];
    cJSON *description = NULL;
    int status = cli_upload_scene(server, path, id, &description);
    const cJSON *warnings = cJSON_GetObjectItemCaseSensitive(description, "warnings");
    for (const cJSON *w = warnings ? warnings->child : NULL; w; w = w->next)
        if (cJSON_IsString(w))
            fprintf(stderr, "warning: %s\n", w->valuestring);
    if (status == CLI_OK)
        puts(id);
    cJSON_Delete(description);
    return status;
}

int cli_scenes(struct cli_args *args)
{
    struct cli_server server;
    const char *words[2] = {"list", NULL};
    bool json = false;
    if (!cli_words(args, &(struct cli_words){"scenes", help_text, words, 2, &server, &json}))
        return args->status;
    if (!strcmp(words[0], "list") && !words[1])
        return list(&server, json);
    bool show = !strcmp(words[0], "show"), remove = !strcmp(words[0], "delete");
    if ((show || remove) && words[1]) {
        if (!cli_is_id(words[1]))
            return cli_fail(CLI_USAGE, "An id has 64 hexadecimal digits.");
        return with_id(&server, show ? "GET" : "DELETE", words[1]);
    }
    if (!strcmp(words[0], "upload") && words[1])
        return upload(&server, words[1]);
    return cli_fail(CLI_USAGE, "See penumbra scenes --help.");
}
