#include "clients/cli/render.h"
#include "clients/cli/parts.h"
#include "clients/cli/request_args.h"
#include "clients/cli/upload.h"
#include "protocol/request.h"
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

static void help(void)
{
    puts("penumbra render SCENE -o FILE [options]\n"
         "\n"
         "SCENE is a .glb, a .gltf with the files that it names, a .zip of these, or the id of a\n"
         "stored scene. It is uploaded only when the server does not have it. Where a zip holds\n"
         "several scenes, FILE.zip#ENTRY takes one.\n"
         "\n"
         "  -o FILE                            where the image goes; its ending names the format; "
         "-:\n"
         "                                     standard output\n"
         "  --technique NAME                   the shadow method; see penumbra techniques\n"
         "  --set NAME=VALUE                   a parameter of the method; may be repeated\n"
         "  --light NAME=VALUE,NAME=VALUE...   adds a light; none: ambient light only\n"
         "  --json FILE                        the request as JSON (-: standard input); flags "
         "after\n"
         "                                     it change it\n"
         "  --json-record                      prints how the image was made, as JSON\n"
         "  --server URL                       default: $PENUMBRA_SERVER or http://127.0.0.1:8080\n"
         "  --retry N                          how often a busy server is asked again (4)\n"
         "  -v                                 prints calls and times\n");
    cli_render_help();
}

struct options {
    struct cli_server server;
    const char *scene, *output;
    bool record, help;
};

static int parse(struct cli_args *args, struct options *options, cJSON *root)
{
    cli_server_init(&options->server);
    while (args->at < args->count && args->status == CLI_OK) {
        const char *positional;
        if (cli_common_option(args, &options->server) || cli_option(args, "o", &options->output))
            continue;
        if (cli_flag(args, "json-record"))
            options->record = true;
        else if (cli_flag(args, "help") || cli_flag(args, "h"))
            options->help = true;
        else if (cli_request_option(args, root))
            continue;
        else if (!options->scene && (positional = cli_positional(args)))
            options->scene = positional;
        else
            return cli_unknown(args, "render");
    }
    if (args->status != CLI_OK || options->help)
        return args->status;
    if (!options->scene)
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
static int choose_format(const struct options *options, cJSON *root)
{
    static const struct {
        const char *ending;
        enum pen_format format;
    } others[] = {{"jpg", PEN_JPEG}, {"tif", PEN_TIFF}};
    const char *name = options->output ? strrchr(options->output, '/') : NULL;
    const char *dot = options->output ? strrchr(name ? name : options->output, '.') : NULL;
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
    bool to_stdout = !strcmp(path, "-");
    char *part = cli_format("%s.part", path);
    FILE *sink = to_stdout ? stdout : fopen(part, "wb");
    int status = sink ? CLI_OK : cli_fail(CLI_FAILED, "%s cannot be written.", part);
    if (status == CLI_OK) {
        call->sink = sink;
        status = cli_call(server, call, &answer);
    }
    if (status == CLI_OK && strncmp(answer.type, kind, strlen(kind)))
        status = cli_fail(CLI_SERVER, "The server's answer is %s, not %s.",
            answer.type[0] ? answer.type : "of no type", word);
    if (sink && (to_stdout ? fflush(sink) : fclose(sink)) && status == CLI_OK)
        status = cli_fail(CLI_FAILED, "%s cannot be written.", path);
    if (status == CLI_OK && !to_stdout && rename(part, path))
        status = cli_fail(CLI_FAILED, "%s cannot be written.", path);
    if (status != CLI_OK && sink && !to_stdout)
        unlink(part);
    if (status == CLI_OK)
        tell(server, &answer, path);
    cli_answer_finish(&answer);
    free(part);
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

static int render(const struct options *options, cJSON *root)
{
    const struct cli_server *server = &options->server;
    char id[PEN_ID_HEX + 1], *image = NULL;
    int status = cli_upload_scene(server, options->scene, id, NULL);
    if (status == CLI_OK)
        status = cli_upload_textures(server, root);
    if (status != CLI_OK)
        return status;
    char *body = cJSON_PrintUnformatted(root), *path = cli_format("/v1/scenes/%s/render", id);
    struct cli_call call = {.method = "POST",
        .path = path,
        .content_type = "application/json",
        .body = body,
        .doing = "rendering"};
    if (options->record)
        status = print_record(server, &call, &image);
    if (status == CLI_OK && options->output) {
        call.accept = accepted(root);
        if (image) { /* the one that the record describes */
            call.method = "GET";
            call.path = image;
            call.content_type = call.body = NULL;
        }
        bool gets_better =
            !image && cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(root, "progressive"));
        status = gets_better ? save_parts(server, &call, options->output)
                             : cli_save_image(server, &call, options->output);
    }
    free(image);
    free(path);
    free(body);
    return status;
}

int cli_render(struct cli_args *args)
{
    struct options options = {0};
    cJSON *root = cJSON_CreateObject();
    int status = parse(args, &options, root);
    if (status == CLI_OK && options.help)
        help();
    else {
        if (status == CLI_OK)
            status = choose_format(&options, root);
        if (status == CLI_OK)
            status = render(&options, root);
    }
    cJSON_Delete(root);
    return status;
}
