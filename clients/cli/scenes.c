#include "clients/cli/listing.h"
#include "clients/cli/render.h"
#include "clients/cli/rows/command.h"
#include "clients/cli/rows/parse.h"
#include "clients/cli/upload.h"
#include "clients/cli/which.h"
#include <curl/curl.h>
#include <stdlib.h>
#include <string.h>

struct options {
    struct cli_common common;
    const char *name, *tag, *tags, *output;
    bool json;
};

static void print_scene(const cJSON *scene)
{
    const cJSON *tags = cJSON_GetObjectItemCaseSensitive(scene, "tags");
    printf("%s %10.0f triangles %8.1f MB  %s  %s", cli_text(scene, "id"),
        cli_number(scene, "triangles"), cli_number(scene, "stored_bytes") / 1e6,
        cli_text(scene, "stored_at"), cli_text(scene, "name"));
    for (const cJSON *tag = tags ? tags->child : NULL; tag; tag = tag->next)
        printf(
            "%s%s", tag == tags->child ? "  [" : ", ", cJSON_IsString(tag) ? tag->valuestring : "");
    puts(tags && tags->child ? "]" : "");
}

static int upload(const struct cli_server *server, const char *path)
{
    char id[PEN_ID_HEX + 1];
    struct cli_stored stored = {0};
    int status = cli_upload_scene(server, path, id, &stored);
    const cJSON *warnings = cJSON_GetObjectItemCaseSensitive(stored.description, "warnings");
    for (const cJSON *w = warnings ? warnings->child : NULL; w; w = w->next)
        if (cJSON_IsString(w))
            fprintf(stderr, "warning: %s\n", w->valuestring);
    if (status == CLI_OK)
        puts(id);
    cJSON_Delete(stored.description);
    return status;
}

static int list(const struct options *options)
{
    char *name = curl_easy_escape(NULL, options->name ? options->name : "", 0);
    char *tag = curl_easy_escape(NULL, options->tag ? options->tag : "", 0);
    char *path = options->name || options->tag
                     ? cli_format("/v1/scenes?name=%s&tag=%s", name ? name : "", tag ? tag : "")
                     : cli_format("/v1/scenes");
    int status = cli_list(&options->common.server, path, "scenes", options->json, print_scene);
    free(path);
    curl_free(name);
    curl_free(tag);
    return status;
}

/* --name NAME and --tags A,B of a scene; an empty one: none any more. */
static int change(const struct options *options, const char *id)
{
    if (!options->name && !options->tags)
        return cli_fail(CLI_USAGE, "What is to be changed? --name NAME, --tags TAG,TAG...");
    cJSON *root = cJSON_CreateObject();
    if (options->name)
        cJSON_AddStringToObject(root, "name", options->name);
    cJSON *tags = options->tags ? cJSON_AddArrayToObject(root, "tags") : NULL;
    char *copy = cli_format("%s", options->tags ? options->tags : "");
    for (char *at = copy, *tag; (tag = strsep(&at, ","));)
        if (*tag)
            cJSON_AddItemToArray(tags, cJSON_CreateString(tag));
    struct cli_answer answer;
    char *body = cJSON_PrintUnformatted(root), *path = cli_format("/v1/scenes/%s", id);
    struct cli_call call = {
        .method = "PATCH", .path = path, .content_type = "application/json", .body = body};
    int status = cli_call(&options->common.server, &call, &answer);
    cJSON *scene = status == CLI_OK ? cli_answer_object(&answer) : NULL;
    if (scene)
        print_scene(scene);
    cJSON_Delete(scene);
    cli_answer_finish(&answer);
    cJSON_Delete(root);
    free(copy);
    free(body);
    free(path);
    return status;
}

static int save_thumbnail(const struct options *options, const char *id)
{
    if (!options->output)
        return cli_fail(CLI_USAGE, "Where to? Give -o FILE.");
    char *path = cli_format("/v1/scenes/%s/thumbnail", id);
    struct cli_call call = {
        .method = "GET", .path = path, .accept = "image/jpeg", .doing = "asking for the picture"};
    int status = cli_save_image(&options->common.server, &call, options->output);
    free(path);
    return status;
}

static int run(const struct cli_command *command, struct cli_args *args)
{
    struct options options = {0};
    char id[PEN_ID_HEX + 1];
    int status = cli_parse(command, args, &options, NULL);
    if (status != CLI_OK || options.common.help)
        return status;
    const struct cli_server *server = &options.common.server;
    const char *word = options.common.count ? options.common.words[0] : "list";
    const char *scene = options.common.words[1];
    if (!strcmp(word, "list") && !scene)
        return list(&options);
    if (!strcmp(word, "upload") && scene)
        return upload(server, scene);
    bool show = !strcmp(word, "show"), remove = !strcmp(word, "delete");
    bool changes = !strcmp(word, "change"), picture = !strcmp(word, "thumbnail");
    if (!scene || !(show || remove || changes || picture))
        return cli_fail(CLI_USAGE, "See penumbra scenes --help.");
    status = cli_find_scene(server, scene, id);
    if (status != CLI_OK)
        return status;
    return changes   ? change(&options, id)
           : picture ? save_thumbnail(&options, id)
                     : cli_with_id(server, show ? "GET" : "DELETE", "/v1/scenes", id);
}

const struct cli_command cli_scenes = {.name = "scenes",
    .summary = "lists, shows, uploads, names and deletes scenes",
    .words = "",
    .actions = (const struct cli_action[]){{"list", "",
                                               "Lists the stored scenes; --name and --tag choose."},
        {"show", "SCENE", "What a scene holds, as JSON.", CLI_OFFER_SCENES},
        {"upload", "FILE", "Uploads a .glb, .gltf or .zip and prints its id.", CLI_OFFER_FILES},
        {"change", "SCENE", "Gives it another --name, or other --tags.", CLI_OFFER_SCENES},
        {"thumbnail", "SCENE", "Leaves its small picture in -o FILE.", CLI_OFFER_SCENES},
        {"delete", "SCENE", "Removes a scene.", CLI_OFFER_SCENES}, {0}},
    .about =
        "Scenes of the server. SCENE is an id, the first digits of one (six or more) that no other "
        "has, or a name. A scene is called as the file that it came in until it is changed. "
        "Without "
        "a word it lists.",
    .rows =
        (const struct cli_row[]){
            {"name", "NAME", "list: only those with this in their name; change: the new one.",
                .offset = offsetof(struct options, name)},
            {"tag", "TAG", "list: only those with this tag.",
                .offset = offsetof(struct options, tag)},
            {"tags", "TAG,TAG...", "change: these instead of those that it has.",
                .offset = offsetof(struct options, tags)},
            {"o", "FILE", "thumbnail: where the picture goes (JPEG); -: standard output.",
                CLI_OFFER_FILES, .offset = offsetof(struct options, output)},
            {"json", NULL, "Lists as JSON.", .offset = offsetof(struct options, json)}, {0}},
    .most_words = 2,
    .run = run};
