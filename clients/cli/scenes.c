#include "clients/cli/listing.h"
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

static void print_scene(const cJSON *scene)
{
    printf("%s %10.0f triangles %8.1f MB  %s\n", cli_text(scene, "id"),
        cli_number(scene, "triangles"), cli_number(scene, "stored_bytes") / 1e6,
        cli_text(scene, "stored_at"));
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
        return cli_list(&server, "/v1/scenes", "scenes", json, print_scene);
    bool show = !strcmp(words[0], "show"), remove = !strcmp(words[0], "delete");
    if ((show || remove) && words[1]) {
        return cli_with_id(&server, show ? "GET" : "DELETE", "/v1/scenes", words[1]);
    }
    if (!strcmp(words[0], "upload") && words[1])
        return upload(&server, words[1]);
    return cli_fail(CLI_USAGE, "See penumbra scenes --help.");
}
