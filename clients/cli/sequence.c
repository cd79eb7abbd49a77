#include "clients/cli/jobs.h"
#include "clients/cli/listing.h"
#include "clients/cli/output.h"
#include "clients/cli/render.h"
#include "clients/cli/request_args.h"
#include "clients/cli/rows/command.h"
#include "clients/cli/rows/parse.h"
#include "clients/cli/upload.h"
#include "protocol/request.h"
#include <stdlib.h>
#include <string.h>
#include <strings.h>

struct options {
    struct cli_common common;
    const char *output;
    bool detach;
};

static const struct cli_row sequence_rows[] = {
    {"o", "OUT", "Where the frames go: FILE.zip, FILE.webp (an animated picture), or a folder.",
        CLI_OFFER_FILES, .offset = offsetof(struct options, output)},
    {"detach", NULL, "Prints the job's id instead of waiting for it.",
        .offset = offsetof(struct options, detach)},
    {0},
};

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
    int status = cli_output_folder(options->output);
    for (uint32_t i = 0; i < count && status == CLI_OK; i++) {
        char *from = cli_format("%s/frames/%u", path, i);
        char *to = cli_format("%s/%06u.%s", options->output, i, format_of(root));
        struct cli_call call = {.method = "GET", .path = from, .accept = "image/*"};
        status = cli_save_image(&options->common.server, &call, to);
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
    int status = cli_save(&options->common.server, &call, options->output,
        webp ? "image/webp" : "application/zip", webp ? "an animated picture" : "a zip");
    free(result);
    return status;
}

static int render(const struct options *options, cJSON *root)
{
    const struct cli_server *server = &options->common.server;
    char id[PEN_ID_HEX + 1], *path = NULL;
    cJSON *job = NULL;
    choose_archive(options, root);
    int status = cli_upload_scene(server, options->common.words[0], id, NULL);
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

static int run(const struct cli_command *command, struct cli_args *args)
{
    struct options options = {0};
    cJSON *root = cJSON_CreateObject();
    int status = cli_parse(command, args, &options, root);
    if (status == CLI_OK && !options.common.help) {
        if (!options.common.count)
            status = cli_fail(CLI_USAGE, "Which scene? See penumbra sequence --help.");
        else if (!options.output && !options.detach)
            status = cli_fail(CLI_USAGE, "Where to? Give -o OUT, or --detach.");
        else
            status = render(&options, root);
    }
    cJSON_Delete(root);
    return status;
}

const struct cli_command cli_sequence = {.name = "sequence",
    .summary = "renders many views of a scene: turntables, keyframes, animations",
    .words = "SCENE -o OUT",
    .about =
        "Renders many views of a scene as a job of the server, waits for it, and fetches what it "
        "gives. Ctrl-C leaves the job to itself: penumbra jobs lists and cancels it. Without one "
        "of "
        "--turntable-*, views and keyframes (both in --json, under \"sequence\") the camera stands "
        "still; --animation poses the scene, 1/fps s further in each frame.\n" CLI_ABOUT_SCENE,
    .rows = sequence_rows,
    .offer = CLI_OFFER_SCENES,
    .requests = CLI_SEQUENCE_REQUEST,
    .most_words = 1,
    .run = run};
