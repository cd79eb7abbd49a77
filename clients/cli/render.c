#include "clients/cli/render.h"
#include "clients/cli/output.h"
#include "clients/cli/parts.h"
#include "clients/cli/request_args.h"
#include "clients/cli/rows/command.h"
#include "clients/cli/rows/parse.h"
#include "clients/cli/upload.h"
#include "protocol/request.h"
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

struct options {
    struct cli_common common;
    const char *output;
    bool record;
};

static const struct cli_row render_rows[] = {
    {"o", "FILE", "Where the image goes; its ending names the format. -: standard output.",
        CLI_OFFER_FILES, .offset = offsetof(struct options, output)},
    {"json-record", NULL, "Prints how the image was made, as JSON.",
        .offset = offsetof(struct options, record)},
    {0},
};

static int check(const struct options *options)
{
    if (!options->common.count)
        return cli_fail(CLI_USAGE, "Which scene? See penumbra render --help.");
    if (!options->output && !options->record)
        return cli_fail(CLI_USAGE, "Where to? Give -o FILE, or --json-record.");
    if (options->output && !strcmp(options->output, "-") &&
        (options->record || isatty(STDOUT_FILENO)))
        return cli_fail(CLI_USAGE,
            options->record ? "-o - and --json-record would both write to standard output."
                            : "An image on a terminal is of no use: give -o a file's name.");
    return CLI_OK;
}

/* The format that the output's ending stands for, unless the request names one. */
int cli_choose_format(const char *path, cJSON *root)
{
    static const struct {
        const char *ending;
        enum pen_format format;
    } others[] = {{"jpg", PEN_JPEG}, {"tif", PEN_TIFF}};
    const char *name = path ? strrchr(path, '/') : NULL;
    const char *dot = path ? strrchr(name ? name : path, '.') : NULL;
    int format = -1;
    if (cli_request_has(root, "output", "format") || !dot || !dot[1])
        return CLI_OK;
    for (int i = 0; i < PEN_FORMATS; i++)
        if (!strcasecmp(dot + 1, pen_format_names[i]))
            format = i;
    for (size_t i = 0; i < sizeof others / sizeof *others; i++)
        if (!strcasecmp(dot + 1, others[i].ending))
            format = (int)others[i].format;
    if (format < 0)
        return cli_fail(CLI_USAGE,
            "\"%s\" names no image format: end it with .png, .exr, .jpg, .webp or .tiff, or give "
            "--format.",
            dot);
    cJSON *output = cJSON_GetObjectItemCaseSensitive(root, "output");
    if (!output)
        output = cJSON_AddObjectToObject(root, "output");
    cJSON_AddStringToObject(output, "format", pen_format_names[format]);
    return CLI_OK;
}

/* Media type of the answer that the request asks for. */
static const char *accepted(const cJSON *root)
{
    const cJSON *output = cJSON_GetObjectItemCaseSensitive(root, "output");
    const cJSON *name = cJSON_GetObjectItemCaseSensitive(output, "format");
    int format = cJSON_IsString(name) ? pen_choice_index(pen_format_names, name->valuestring) : 0;
    return format < 0 ? "image/*" : pen_format_mime[format];
}

int cli_upload_textures(const struct cli_server *server, cJSON *root)
{
    const cJSON *lights = cJSON_GetObjectItemCaseSensitive(root, "lights");
    for (cJSON *light = lights ? lights->child : NULL; light; light = light->next) {
        cJSON *texture = cJSON_GetObjectItemCaseSensitive(light, "texture");
        const cJSON *file = cJSON_GetObjectItemCaseSensitive(texture, "file");
        char id[PEN_ID_HEX + 1];
        if (!cJSON_IsString(file))
            continue;
        int status = cli_upload_image(server, file->valuestring, id);
        if (status != CLI_OK)
            return status;
        cJSON_DeleteItemFromObjectCaseSensitive(texture, "file");
        cJSON_AddStringToObject(texture, "image", id);
    }
    return CLI_OK;
}

/* What the answer says besides the picture. */
static void tell(const struct cli_server *server, struct cli_answer *answer, const char *path)
{
    for (char *at = answer->warnings, *line; (line = strsep(&at, "\n"));)
        if (*line)
            fprintf(stderr, "warning: %s\n", line);
    if (answer->choice[0])
        fprintf(stderr, "chosen: %s\n", answer->choice);
    if (server->verbose)
        fprintf(stderr, "%s: %zu bytes; %s\n", path, answer->bytes, answer->timing);
}

int cli_save(const struct cli_server *server, struct cli_call *call, const char *path,
    const char *kind, const char *word)
{
    struct cli_answer answer = {0};
    struct cli_output output;
    int status = cli_output_open(&output, path);
    if (status == CLI_OK) {
        call->sink = output.file;
        status = cli_call(server, call, &answer);
    }
    if (status == CLI_OK && strncmp(answer.type, kind, strlen(kind)))
        status = cli_fail(CLI_SERVER, "The server's answer is %s, not %s.",
            answer.type[0] ? answer.type : "of no type", word);
    status = cli_output_end(&output, status);
    if (status == CLI_OK)
        tell(server, &answer, path);
    cli_answer_finish(&answer);
    return status;
}

int cli_save_image(const struct cli_server *server, struct cli_call *call, const char *path)
{
    return cli_save(server, call, path, "image/", "an image");
}

/* Prints the record; *image is where it says that the image can be fetched, or NULL. */
static int print_record(const struct cli_server *server, struct cli_call *call, char **image)
{
    struct cli_answer answer;
    *image = NULL;
    call->accept = "application/json";
    int status = cli_call(server, call, &answer);
    cJSON *record = status == CLI_OK ? cli_answer_object(&answer) : NULL;
    if (status == CLI_OK && !record)
        status = CLI_SERVER;
    if (record) {
        puts(answer.text);
        const cJSON *href = cJSON_GetObjectItemCaseSensitive(
            cJSON_GetObjectItemCaseSensitive(record, "image"), "href");
        if (cJSON_IsString(href) && href->valuestring[0] == '/')
            *image = cli_format("%s", href->valuestring);
    }
    cJSON_Delete(record);
    cli_answer_finish(&answer);
    return status;
}

static int save_parts(const struct cli_server *server, struct cli_call *call, const char *path)
{
    struct cli_answer answer;
    int status = cli_save_parts(server, call, path, &answer);
    if (status == CLI_OK)
        tell(server, &answer, path);
    cli_answer_finish(&answer);
    return status;
}

int cli_render_scene(
    const struct cli_server *server, const char *id, cJSON *root, bool record, const char *output)
{
    char *image = NULL;
    int status = cli_upload_textures(server, root);
    if (status != CLI_OK)
        return status;
    char *body = cJSON_PrintUnformatted(root), *path = cli_format("/v1/scenes/%s/render", id);
    struct cli_call call = {.method = "POST",
        .path = path,
        .content_type = "application/json",
        .body = body,
        .doing = "rendering"};
    if (record)
        status = print_record(server, &call, &image);
    if (status == CLI_OK && output) {
        call.accept = accepted(root);
        if (image) { /* the one that the record describes */
            call.method = "GET";
            call.path = image;
            call.content_type = call.body = NULL;
        }
        bool gets_better =
            !image && cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(root, "progressive"));
        status =
            gets_better ? save_parts(server, &call, output) : cli_save_image(server, &call, output);
    }
    free(image);
    free(path);
    free(body);
    return status;
}

static int run(const struct cli_command *command, struct cli_args *args)
{
    struct options options = {0};
    char id[PEN_ID_HEX + 1];
    cJSON *root = cJSON_CreateObject();
    int status = cli_parse(command, args, &options, root);
    if (status == CLI_OK && !options.common.help) {
        status = check(&options);
        if (status == CLI_OK)
            status = cli_choose_format(options.output, root);
        if (status == CLI_OK)
            status = cli_upload_scene(&options.common.server, options.common.words[0], id, NULL);
        if (status == CLI_OK)
            status =
                cli_render_scene(&options.common.server, id, root, options.record, options.output);
    }
    cJSON_Delete(root);
    return status;
}

const struct cli_command cli_render = {.name = "render",
    .summary = "renders a scene with soft shadows",
    .words = "SCENE -o FILE",
    .about = CLI_ABOUT_SCENE " It is uploaded only when the server does not have it.",
    .rows = render_rows,
    .offer = CLI_OFFER_SCENES,
    .requests = CLI_RENDER_REQUEST,
    .most_words = 1,
    .run = run};
