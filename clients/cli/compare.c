#include "clients/cli/output.h"
#include "clients/cli/render.h"
#include "clients/cli/request_args.h"
#include "clients/cli/rows/command.h"
#include "clients/cli/rows/parse.h"
#include "clients/cli/upload.h"
#include <stdlib.h>
#include <string.h>

#define DEADLINE_MS 600000

struct options {
    struct cli_common common;
    const char *techniques, *reference, *out;
    bool record;
};

static const struct cli_row compare_rows[] = {
    {"techniques", "LIST", "all, or names joined by commas; default: all.", CLI_OFFER_TECHNIQUES,
        .offset = offsetof(struct options, techniques)},
    {"reference", "NAME", "What is compared with; default: raytraced with 1024 samples.",
        CLI_OFFER_TECHNIQUES, .offset = offsetof(struct options, reference)},
    {"out", "DIR",
        "Writes images, difference images, SSIM and FLIP maps and comparison.json there.",
        CLI_OFFER_FOLDERS, .offset = offsetof(struct options, out)},
    {"json-record", NULL, "Prints the server's answer instead of the table.",
        .offset = offsetof(struct options, record)},
    {0},
};

static void put_string(cJSON *root, const char *key, const char *value)
{
    cJSON_DeleteItemFromObjectCaseSensitive(root, key);
    cJSON_AddStringToObject(root, key, value);
}

static void put_list(cJSON *root, const char *names)
{
    if (!strcmp(names, "all")) {
        put_string(root, "techniques", names);
        return;
    }
    cJSON_DeleteItemFromObjectCaseSensitive(root, "techniques");
    cJSON *list = cJSON_AddArrayToObject(root, "techniques");
    char *copy = cli_format("%s", names);
    for (char *at = copy, *name; (name = strsep(&at, ","));)
        if (*name)
            cJSON_AddItemToArray(list, cJSON_CreateString(name));
    free(copy);
}

/* ---- the table ---- */

static const cJSON *member(const cJSON *object, const char *key)
{
    return cJSON_GetObjectItemCaseSensitive(object, key);
}

static const char *text(const cJSON *item)
{
    return cJSON_IsString(item) ? item->valuestring : "";
}

static const char *name_of(const cJSON *row)
{
    return text(member(member(row, "technique"), "name"));
}

static void print_number(const cJSON *row, const char *key, int width, int digits)
{
    const cJSON *item = member(row, key);
    if (cJSON_IsNumber(item))
        printf("  %*.*f", width, digits, item->valuedouble);
    else
        printf("  %*s", width, "-");
}

static void print_row(const cJSON *row, int width)
{
    const cJSON *error = member(row, "error");
    printf("%-*s", width, name_of(row));
    if (cJSON_IsString(error)) {
        printf("  %s\n", error->valuestring);
        return;
    }
    print_number(row, "rmse", 8, 5);
    print_number(row, "rmse_penumbra", 8, 5);
    print_number(row, "ssim", 8, 5);
    print_number(row, "flip", 8, 5);
    print_number(row, "shadow_ms", 10, 2);
    print_number(row, "total_ms", 10, 2);
    putchar('\n');
}

static void print_warnings(const char *name, const cJSON *row)
{
    const cJSON *list = member(row, "warnings");
    for (const cJSON *w = list ? list->child : NULL; w; w = w->next)
        fprintf(stderr, "warning: %s%s%s\n", name, *name ? ": " : "", text(w));
}

static void print_table(const cJSON *answer)
{
    const cJSON *methods = member(answer, "methods"), *reference = member(answer, "reference");
    int width = (int)strlen("method");
    for (const cJSON *row = methods ? methods->child : NULL; row; row = row->next)
        width = (int)strlen(name_of(row)) > width ? (int)strlen(name_of(row)) : width;
    int of_reference = (int)strlen(name_of(reference));
    width = of_reference > width ? of_reference : width;
    printf("%-*s  %8s  %8s  %8s  %8s  %10s  %10s\n", width, "method", "rmse", "penumbra", "ssim",
        "flip", "shadow ms", "total ms");
    for (const cJSON *row = methods ? methods->child : NULL; row; row = row->next)
        print_row(row, width);
    print_row(reference, width);
    print_warnings("", answer);
    for (const cJSON *row = methods ? methods->child : NULL; row; row = row->next)
        print_warnings(name_of(row), row);
}

/* ---- the folder ---- */

static int save_row(const struct options *options, const cJSON *row, int number)
{
    static const struct {
        const char *key, *ending;
    } pictures[] = {
        {"image", ""}, {"difference", "-difference"}, {"ssim_map", "-ssim"}, {"flip_map", "-flip"}};
    int status = CLI_OK;
    for (size_t i = 0; status == CLI_OK && i < sizeof pictures / sizeof *pictures; i++) {
        const cJSON *href = member(member(row, "links"), pictures[i].key);
        if (!cJSON_IsString(href) || href->valuestring[0] != '/')
            continue;
        char *path = number ? cli_format("%s/%02d-%s%s.png", options->out, number, name_of(row),
                                  pictures[i].ending)
                            : cli_format("%s/reference.png", options->out);
        struct cli_call call = {.method = "GET",
            .path = href->valuestring,
            .accept = "image/png",
            .doing = "fetching pictures"};
        status = cli_save_image(&options->common.server, &call, path);
        free(path);
    }
    return status;
}

static bool has_pictures(const cJSON *row)
{
    return cJSON_IsString(member(member(row, "links"), "image"));
}

static int save_all(const struct options *options, const cJSON *answer, const char *json)
{
    const cJSON *methods = member(answer, "methods");
    if (!has_pictures(member(answer, "reference")))
        fputs(
            "warning: the server kept no pictures: its result cache is off or too small\n", stderr);
    char *path = cli_format("%s/comparison.json", options->out);
    struct cli_output output;
    int status = cli_output_open(&output, path);
    if (status == CLI_OK)
        fputs(json, output.file);
    status = cli_output_end(&output, status);
    free(path);
    if (status == CLI_OK)
        status = save_row(options, member(answer, "reference"), 0);
    int number = 1;
    for (const cJSON *row = methods ? methods->child : NULL; row && status == CLI_OK;
         row = row->next)
        status = save_row(options, row, number++);
    return status;
}

static int compare(const struct options *options, cJSON *root)
{
    const struct cli_server *server = &options->common.server;
    char id[PEN_ID_HEX + 1];
    /* Before the comparison, which may take minutes. */
    int status = options->out ? cli_output_folder(options->out) : CLI_OK;
    if (status == CLI_OK)
        status = cli_upload_scene(server, options->common.words[0], id, NULL);
    if (status == CLI_OK)
        status = cli_upload_textures(server, root);
    if (status != CLI_OK)
        return status;
    char *body = cJSON_PrintUnformatted(root), *path = cli_format("/v1/scenes/%s/compare", id);
    struct cli_call call = {.method = "POST",
        .path = path,
        .content_type = "application/json",
        .body = body,
        .doing = "comparing"};
    struct cli_answer answer;
    status = cli_call(server, &call, &answer);
    cJSON *document = status == CLI_OK ? cli_answer_object(&answer) : NULL;
    if (status == CLI_OK && !document)
        status = CLI_SERVER;
    if (status == CLI_OK && options->record)
        puts(answer.text);
    else if (status == CLI_OK)
        print_table(document);
    if (status == CLI_OK && options->out)
        status = save_all(options, document, answer.text);
    cJSON_Delete(document);
    cli_answer_finish(&answer);
    free(path);
    free(body);
    return status;
}

static int run(const struct cli_command *command, struct cli_args *args)
{
    struct options options = {0};
    cJSON *root = cJSON_CreateObject();
    int status = cli_parse(command, args, &options, root);
    if (status == CLI_OK && !options.common.help && !options.common.count)
        status = cli_fail(CLI_USAGE, "Which scene? See penumbra compare --help.");
    if (status == CLI_OK && !options.common.help) {
        if (options.techniques)
            put_list(root, options.techniques);
        if (options.reference)
            put_string(root, "reference", options.reference);
        if (!cli_request_has(root, NULL, "deadline_ms"))
            cJSON_AddNumberToObject(root, "deadline_ms", DEADLINE_MS);
        status = compare(&options, root);
    }
    cJSON_Delete(root);
    return status;
}

const struct cli_command cli_compare = {.name = "compare",
    .summary = "measures shadow methods against a reference",
    .words = "SCENE",
    .about =
        "Renders a view with several shadow methods and with a reference, and prints how far they "
        "are "
        "from it (rmse: of the mean visibility; penumbra: the same where the reference lies "
        "between "
        "0.02 and 0.98; ssim, flip: of the picture) and what they cost in milliseconds (shadow: "
        "its "
        "inputs and the method; total: with G-buffer and shading; nothing cached). With --json a "
        "comparison, in which techniques can have params.\n" CLI_ABOUT_SCENE,
    .rows = compare_rows,
    .offer = CLI_OFFER_SCENES,
    .requests = CLI_RENDER_REQUEST,
    .most_words = 1,
    .run = run};
