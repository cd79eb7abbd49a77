#include "clients/cli/jobs.h"
#include "clients/cli/listing.h"
#include "clients/cli/render.h"
#include "clients/cli/request_args.h"
#include "clients/cli/upload.h"
#include "protocol/request.h"
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

static void help(void)
{
    puts(
        "penumbra sequence SCENE -o OUT [options]\n"
        "\n"
        "Renders many views of a scene as a job of the server, waits for it, and fetches what it\n"
        "gives. OUT is FILE.zip, FILE.webp (an animated picture), or a folder for the frames. "
        "Ctrl-C\n"
        "leaves the job to itself: penumbra jobs lists and cancels it. Without one of\n"
        "--turntable-*, views and keyframes (both in --json, under \"sequence\") the camera "
        "stands\n"
        "still; --animation poses the scene, 1/fps s further in each frame.\n"
        "\n"
        "  -o OUT                             where the frames go\n"
        "  --detach                           prints the job's id instead of waiting for it\n"
        "  --json FILE, --technique NAME, --set NAME=VALUE, --light ..., --server URL, --retry N,\n"
        "  -v                                 as for penumbra render\n");
    cli_sequence_help();
}

struct options {
    struct cli_server server;
    const char *scene, *output;
    bool detach, help;
};

static int parse(struct cli_args *args, struct options *options, cJSON *root)
{
    cli_server_init(&options->server);
    while (args->at < args->count && args->status == CLI_OK) {
        const char *positional;
        if (cli_common_option(args, &options->server) || cli_option(args, "o", &options->output))
            continue;
        if (cli_flag(args, "detach"))
            options->detach = true;
        else if (cli_flag(args, "help") || cli_flag(args, "h"))
            options->help = true;
        else if (cli_sequence_option(args, root))
            continue;
        else if (!options->scene && (positional = cli_positional(args)))
            options->scene = positional;
        else
            return cli_unknown(args, "sequence");
    }
    if (args->status != CLI_OK || options->help)
        return args->status;
    if (!options->scene)
        return cli_fail(CLI_USAGE, "Which scene? See penumbra sequence --help.");
    if (!options->output && !options->detach)
        return cli_fail(CLI_USAGE, "Where to? Give -o OUT, or --detach.");
    return CLI_OK;
}

static bool ends_with(const char *text, const char *ending)
{
    size_t bytes = text ? strlen(text) : 0, tail = strlen(ending);
    return bytes > tail && !strcasecmp(text + bytes - tail, ending);
}

/* What all frames together are to be, as the output's ending says. */
static void choose_archive(const struct options *options, cJSON *root)
{
    bool webp = ends_with(options->output, ".webp"), zip = ends_with(options->output, ".zip");
    cJSON *sequence = cJSON_GetObjectItemCaseSensitive(root, "sequence");
    if (!sequence)
        sequence = cJSON_AddObjectToObject(root, "sequence");
    if (!cli_request_has(root, "sequence", "archive") && options->output)
        cJSON_AddStringToObject(sequence, "archive", webp ? "webp" : zip ? "zip" : "none");
    if (!webp || cli_request_has(root, "output", "format"))
        return;
    cJSON *output = cJSON_GetObjectItemCaseSensitive(root, "output");
    if (!output)
        output = cJSON_AddObjectToObject(root, "output");
    cJSON_AddStringToObject(output, "format", pen_format_names[PEN_WEBP]);
}

/* Starts the job; *path is its address. */
static int start(const struct cli_server *server, const cJSON *root, char **path)
{
    struct cli_answer answer;
    char *body = cJSON_PrintUnformatted(root);
    struct cli_call call = {.method = "POST",
        .path = "/v1/jobs",
        .content_type = "application/json",
        .body = body,
        .doing = "asking for a sequence"};
    int status = cli_call(server, &call, &answer);
    if (status == CLI_OK && answer.location[0] != '/')
        status = cli_fail(CLI_SERVER, "The server does not say where the job is.");
    *path = status == CLI_OK ? cli_format("%s", answer.location) : NULL;
    cli_answer_finish(&answer);
    free(body);
    return status;
}

static const char *format_of(const cJSON *root)
{
    const char *format = cli_text(cJSON_GetObjectItemCaseSensitive(root, "output"), "format");
    return *format ? format : pen_format_names[PEN_PNG];
}

static int fetch_frames(
    const struct options *options, const char *path, const cJSON *root, uint32_t count)
{
    int status = CLI_OK;
    if (mkdir(options->output, 0777) && errno != EEXIST)
        return cli_fail(CLI_FAILED, "%s cannot be made: %s.", options->output, strerror(errno));
    for (uint32_t i = 0; i < count && status == CLI_OK; i++) {
        char *from = cli_format("%s/frames/%u", path, i);
        char *to = cli_format("%s/%06u.%s", options->output, i, format_of(root));
        struct cli_call call = {.method = "GET", .path = from, .accept = "image/*"};
        status = cli_save_image(&options->server, &call, to);
        free(from);
        free(to);
    }
    return status;
}

static int fetch(const struct options *options, const char *path, const cJSON *root, cJSON *job)
{
    bool webp = ends_with(options->output, ".webp"), zip = ends_with(options->output, ".zip");
    const cJSON *frames = cJSON_GetObjectItemCaseSensitive(job, "frames");
    if (!webp && !zip)
        return fetch_frames(options, path, root, (uint32_t)cli_number(frames, "total"));
    char *result = cli_format("%s/result", path);
    struct cli_call call = {.method = "GET", .path = result, .accept = "*/*"};
    int status = cli_save(&options->server, &call, options->output,
        webp ? "image/webp" : "application/zip", webp ? "an animated picture" : "a zip");
    free(result);
    return status;
}

static int run(const struct options *options, cJSON *root)
{
    const struct cli_server *server = &options->server;
    char id[PEN_ID_HEX + 1], *path = NULL;
    cJSON *job = NULL;
    choose_archive(options, root);
    int status = cli_upload_scene(server, options->scene, id, NULL);
    if (status == CLI_OK)
        status = cli_upload_textures(server, root);
    if (status == CLI_OK) {
        cJSON_AddStringToObject(root, "scene", id);
        status = start(server, root, &path);
    }
    if (status == CLI_OK && options->detach)
        puts(strrchr(path, '/') + 1);
    else if (status == CLI_OK && (status = cli_wait_job(server, path, &job)) == CLI_OK)
        status = fetch(options, path, root, job);
    cJSON_Delete(job);
    free(path);
    return status;
}

int cli_sequence(struct cli_args *args)
{
    struct options options = {0};
    cJSON *root = cJSON_CreateObject();
    int status = parse(args, &options, root);
    if (status == CLI_OK && options.help)
        help();
    else if (status == CLI_OK)
        status = run(&options, root);
    cJSON_Delete(root);
    return status;
}
