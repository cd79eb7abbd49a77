#include "clients/cli/request_args.h"
#include "clients/cli/upload.h"
#include "protocol/json_sequence.h"
#include <stdlib.h>
#include <string.h>

#define ORBIT PEN_CAMERA_BIT(PEN_CAMERA_ORBIT)

/* Where each table's rows stand in the body, and what their flags start with. */
static const struct row_set {
    const char *prefix, *group, *inner;
    struct pen_param_table (*table)(void);
    uint32_t only, except; /* masks: see pen_param.applies */
} row_sets[] = {
    {"", NULL, NULL, pen_request_table, 0, 0},
    {"", NULL, NULL, pen_delivery_table, 0, 0},
    {"", "output", NULL, pen_output_table, 0, 0},
    {"camera-", "camera", NULL, pen_camera_table, 0, ORBIT},
    {"orbit-", "camera", "orbit", pen_camera_table, ORBIT, 0},
    /* From here on of sequences only. */
    {"", "sequence", NULL, pen_sequence_table, 0, 0},
    {"turntable-", "sequence", "turntable", pen_turntable_table, 0, 0},
};
#define REQUEST_SETS 5
#define ROW_SETS (sizeof row_sets / sizeof *row_sets)

static bool is_in(const struct row_set *set, const struct pen_param *row)
{
    return !(set->only && row->applies != set->only) &&
           !(set->except && row->applies == set->except);
}

static void flag_name(const struct row_set *set, const struct pen_param *row, char name[64])
{
    snprintf(name, 64, "%s%s", set->prefix, row->name);
    for (char *c = name; *c; c++)
        if (*c == '_')
            *c = '-';
}

static void put(cJSON *object, const char *key, cJSON *item)
{
    cJSON_DeleteItemFromObjectCaseSensitive(object, key);
    cJSON_AddItemToObject(object, key, item);
}

/* The object that is the member `key`, made when there is none. */
static cJSON *inside(cJSON *object, const char *key)
{
    cJSON *member = cJSON_GetObjectItemCaseSensitive(object, key);
    if (cJSON_IsObject(member))
        return member;
    put(object, key, cJSON_CreateObject());
    return cJSON_GetObjectItemCaseSensitive(object, key);
}

static cJSON *inside_technique(cJSON *root)
{
    cJSON *technique = cJSON_GetObjectItemCaseSensitive(root, "technique");
    char *name = cJSON_IsString(technique) ? cli_format("%s", technique->valuestring) : NULL;
    technique = inside(root, "technique");
    if (name)
        cJSON_AddStringToObject(technique, "name", name);
    free(name);
    return technique;
}

/* A checked value of the row; NULL after reporting what is wrong with it. */
static cJSON *row_value(
    struct cli_args *args, const struct pen_param *row, const char *flag, const char *text)
{
    static struct pen_request scratch; /* at least as large as every table's struct */
    struct pen_error error = {0};
    if (!pen_param_parse(row, &scratch, text, "", &error)) {
        args->status = cli_fail(CLI_USAGE, "%s: %s", flag, error.message);
        return NULL;
    }
    if (row->choices || row->type == PEN_PARAM_TEXT || pen_param_is_word(row, &scratch))
        return cJSON_CreateString(text);
    if (row->type == PEN_PARAM_FLAG)
        return cJSON_CreateBool(pen_param_load(row, &scratch, 0) != 0);
    return cli_guess(text);
}

static bool row_option(struct cli_args *args, cJSON *root, size_t first, size_t end)
{
    for (size_t s = first; s < end; s++) {
        struct pen_param_table table = row_sets[s].table();
        for (uint32_t r = 0; r < table.count; r++) {
            const struct pen_param *row = &table.rows[r];
            char name[64], flag[80];
            const char *value;
            if (!is_in(&row_sets[s], row))
                continue;
            flag_name(&row_sets[s], row, name);
            snprintf(flag, sizeof flag, "no-%s", name);
            if (row->type == PEN_PARAM_FLAG && cli_flag(args, flag))
                value = "off";
            else if (row->type == PEN_PARAM_FLAG && cli_flag(args, name))
                value = "on";
            else if (!cli_option(args, name, &value))
                continue;
            snprintf(flag, sizeof flag, "--%s", name);
            cJSON *object = row_sets[s].group ? inside(root, row_sets[s].group) : root;
            if (row_sets[s].inner)
                object = inside(object, row_sets[s].inner);
            cJSON *item = args->status ? NULL : row_value(args, row, flag, value);
            if (item)
                put(object, row->name, item);
            return true;
        }
    }
    return false;
}

static bool set_option(struct cli_args *args, cJSON *root)
{
    const char *value;
    if (!cli_option(args, "set", &value))
        return false;
    const char *equals = strchr(value, '=');
    if (!equals || equals == value) {
        args->status = cli_fail(CLI_USAGE, "--set takes name=value.");
        return true;
    }
    char *key = cli_format("%.*s", (int)(equals - value), value);
    put(inside(inside_technique(root), "params"), key, cli_guess(equals + 1));
    free(key);
    return true;
}

/* texture=checker, texture=<id> or texture=FILE; a file is uploaded before the render. */
static cJSON *texture_of(const char *text)
{
    cJSON *texture = cJSON_CreateObject();
    const char *key = pen_choice_index(pen_pattern_names, text) >= 0 ? "pattern"
                      : cli_is_id(text)                              ? "image"
                                                                     : "file";
    cJSON_AddStringToObject(texture, key, text);
    return texture;
}

static void light_member(struct cli_args *args, cJSON *light, const char *key, const char *value)
{
    const struct pen_param *row = pen_param_find(pen_light_table(), key);
    cJSON *item;
    if (!strcmp(key, "texture"))
        item = texture_of(value);
    else if (!strcmp(key, "type"))
        item = cJSON_CreateString(value);
    else if (row)
        item = row_value(args, row, "--light", value);
    else
        item = cli_guess(value); /* the server says what is wrong with it */
    if (item)
        put(light, key, item);
}

static bool light_option(struct cli_args *args, cJSON *root)
{
    const char *value;
    if (!cli_option(args, "light", &value))
        return false;
    cJSON *lights = cJSON_GetObjectItemCaseSensitive(root, "lights");
    if (!cJSON_IsArray(lights) || !strcmp(value, "none")) {
        put(root, "lights", cJSON_CreateArray());
        lights = cJSON_GetObjectItemCaseSensitive(root, "lights");
    }
    if (!strcmp(value, "none"))
        return true;
    cJSON *light = cJSON_CreateObject();
    cJSON_AddItemToArray(lights, light);
    char *copy = cli_format("%s", value);
    for (char *at = copy; at && !args->status;) {
        char *equals = strchr(at, '=');
        if (!equals || equals == at || memchr(at, ',', (size_t)(equals - at))) {
            args->status = cli_fail(CLI_USAGE, "--light takes name=value,name=value, or none.");
            break;
        }
        *equals = 0;
        /* A comma ends the value only where another name follows: 1,2,3 is one value. */
        char *next = strchr(equals + 1, '=');
        while (next && *next != ',' && next > equals + 1)
            next--;
        if (next && *next == ',')
            *next++ = 0;
        else
            next = NULL;
        light_member(args, light, at, equals + 1);
        at = next;
    }
    free(copy);
    return true;
}

static bool json_option(struct cli_args *args, cJSON *root)
{
    static char text[PEN_MAX_JSON_BYTES + 1];
    const char *path;
    if (!cli_option(args, "json", &path))
        return false;
    if (args->status)
        return true;
    FILE *file = strcmp(path, "-") ? fopen(path, "rb") : stdin;
    size_t bytes = file ? fread(text, 1, sizeof text, file) : 0;
    if (file && file != stdin)
        fclose(file);
    cJSON *body = bytes && bytes < sizeof text ? cJSON_ParseWithLength(text, bytes) : NULL;
    if (!file)
        args->status = cli_fail(CLI_FAILED, "%s cannot be read.", path);
    else if (!cJSON_IsObject(body))
        args->status = cli_fail(
            CLI_FAILED, "%s holds no JSON object of at most %d bytes.", path, PEN_MAX_JSON_BYTES);
    while (!args->status && body->child) {
        char *key = cli_format("%s", body->child->string);
        put(root, key, cJSON_DetachItemViaPointer(body, body->child));
        free(key);
    }
    cJSON_Delete(body);
    return true;
}

bool cli_request_option(struct cli_args *args, cJSON *root)
{
    const char *value;
    if (cli_option(args, "technique", &value)) {
        put(inside_technique(root), "name", cJSON_CreateString(value));
        return true;
    }
    return set_option(args, root) || light_option(args, root) || json_option(args, root) ||
           row_option(args, root, 0, REQUEST_SETS);
}

bool cli_sequence_option(struct cli_args *args, cJSON *root)
{
    return row_option(args, root, REQUEST_SETS, ROW_SETS) || cli_request_option(args, root);
}

bool cli_request_has(const cJSON *root, const char *group, const char *key)
{
    const cJSON *object = group ? cJSON_GetObjectItemCaseSensitive(root, group) : root;
    return cJSON_GetObjectItemCaseSensitive(object, key) != NULL;
}

/* ---- how they are shown ---- */

static const char *flag_word(double value)
{
    return value != 0 ? "on" : "off";
}

/* "0.01 to 1000 frames/s; default: 24", "" when there is nothing to say. */
static char *describe(const struct pen_param *row)
{
    char *range = cli_format("%s", ""), *standard, *all;
    if (row->choices)
        for (int i = 0; row->choices[i]; i++) {
            char *longer = cli_format("%s%s%s", range, i ? ", " : "one of ", row->choices[i]);
            free(range);
            range = longer;
        }
    else if (row->type != PEN_PARAM_FLAG && row->type != PEN_PARAM_TEXT) {
        free(range);
        range = cli_format(
            "%g to %g%s%s", row->min, row->max, row->unit ? " " : "", row->unit ? row->unit : "");
    }
    if (row->automatic)
        standard = cli_format("default: what suits");
    else if (row->type == PEN_PARAM_TEXT)
        standard = cli_format("%s", "");
    else if (row->choices)
        standard = cli_format("default: %s", row->choices[(int)row->def]);
    else if (row->type == PEN_PARAM_FLAG)
        standard = cli_format("default: %s", flag_word(row->def));
    else if (row->count == 3)
        standard = cli_format("default: %g,%g,%g", row->def_v[0], row->def_v[1], row->def_v[2]);
    else
        standard = cli_format("default: %g", row->def);
    all = cli_format("%s%s%s%s%s%s", row->help, *range || *standard ? " (" : "", range,
        *range && *standard ? "; " : "", standard, *range || *standard ? ")" : "");
    free(range);
    free(standard);
    return all;
}

static void show_row(
    const struct row_set *set, const struct pen_param *row, cli_show *show, void *context)
{
    char name[64], usage[160], *help = describe(row);
    flag_name(set, row, name);
    if (row->type == PEN_PARAM_FLAG)
        snprintf(usage, sizeof usage, row->word ? "--%s[=%s], --no-%s" : "--%s, %s--no-%s", name,
            row->word ? row->word : "", name);
    else
        snprintf(usage, sizeof usage, "--%s %s%s%s", name,
            row->choices || row->type == PEN_PARAM_TEXT ? "NAME"
            : row->count == 3                           ? "X,Y,Z"
                                                        : "N",
            row->word ? "|" : "", row->word ? row->word : "");
    bool flag = row->type == PEN_PARAM_FLAG;
    show(context, &(struct cli_shown){.name = name,
                      .usage = usage,
                      .help = help,
                      .flag = flag,
                      .negatable = flag,
                      .choices = row->choices,
                      .word = flag ? NULL : row->word});
    free(help);
}

static void show_rows(size_t first, size_t end, cli_show *show, void *context)
{
    for (size_t s = first; s < end; s++) {
        struct pen_param_table table = row_sets[s].table();
        for (uint32_t r = 0; r < table.count; r++)
            if (is_in(&row_sets[s], &table.rows[r]))
                show_row(&row_sets[s], &table.rows[r], show, context);
    }
}

void cli_each_request_row(bool sequence, cli_show *show, void *context)
{
    static const struct cli_shown own[] = {
        {.name = "technique",
            .usage = "--technique NAME",
            .help = "The shadow method; see penumbra techniques.",
            .offer = CLI_OFFER_TECHNIQUES},
        {.name = "set",
            .usage = "--set NAME=VALUE",
            .help = "A parameter of the method; may be repeated."},
        {.name = "light",
            .usage = "--light NAME=VALUE,NAME=VALUE...",
            .help = "Adds a light, with the keys below; none: ambient light only."},
        {.name = "json",
            .usage = "--json FILE",
            .help = "The request as JSON (-: standard input); flags after it change it.",
            .offer = CLI_OFFER_FILES},
    };
    for (size_t i = 0; i < sizeof own / sizeof *own; i++)
        show(context, &own[i]);
    if (sequence)
        show_rows(REQUEST_SETS, ROW_SETS, show, context);
    show_rows(0, REQUEST_SETS, show, context);
}

/* A list of names, "rect, disk". */
static char *join(const char *const *names, uint32_t mask)
{
    char *list = cli_format("%s", "");
    for (int i = 0; names[i]; i++) {
        if (mask && !(mask & 1u << i))
            continue;
        char *longer = cli_format("%s%s%s", list, *list ? ", " : "", names[i]);
        free(list);
        list = longer;
    }
    return list;
}

void cli_each_light_key(cli_show *show, void *context)
{
    char *types = join(pen_light_type_names, 0), *patterns = join(pen_pattern_names, 0);
    char *type = cli_format("One of %s; default: %s.", types, pen_light_type_names[0]);
    char *texture =
        cli_format("What a rect emits: an image file, the id of a stored one, or one of "
                   "the patterns %s. Black texels cut any shape.",
            patterns);
    show(context, &(struct cli_shown){.name = "type", .usage = "type", .help = type});
    show(context, &(struct cli_shown){.name = "texture", .usage = "texture", .help = texture});
    struct pen_param_table table = pen_light_table();
    for (uint32_t r = 0; r < table.count; r++) {
        const struct pen_param *row = &table.rows[r];
        char *of = row->applies ? join(pen_light_type_names, row->applies) : NULL;
        char *help = describe(row);
        char *all = cli_format("%s%s%s", of ? of : "", of ? ": " : "", help);
        show(context, &(struct cli_shown){.name = row->name, .usage = row->name, .help = all});
        free(of);
        free(help);
        free(all);
    }
    free(types);
    free(patterns);
    free(type);
    free(texture);
}
