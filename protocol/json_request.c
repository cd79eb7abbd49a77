#include "protocol/json_reader.h"
#include "protocol/json_request.h"
#include "protocol/json_scan.h"
#include "protocol/json_suggest.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

struct reader {
    const struct pen_catalogue *catalogue;
    struct pen_error *error;
    bool text; /* leaves are text (a query string), not typed JSON */
    char pointer[sizeof((struct pen_error *)0)->pointer];
};

/* One set of rows that an object's keys may come from. */
struct group {
    struct pen_param_table table;
    void *base;
    uint32_t applies; /* bit that a row must have in its mask; 0: none */
    uint32_t only;    /* when not 0: just the rows with exactly this mask */
    uint32_t except;  /* when not 0: not the rows with exactly this mask */
    const char *kind; /* what `applies` stands for: "rect light" */
};

/* A key whose value is not one row. */
struct special {
    const char *key;
    bool (*read)(struct reader *, const cJSON *, void *);
    void *object;
};

/* Appends "/key" (RFC 6901) to the pointer and returns its length before. A key that does not fit
 * leaves the pointer at its parent. */
static size_t push(struct reader *reader, const char *key)
{
    size_t before = strlen(reader->pointer), at = before;
    char *out = reader->pointer;
    const size_t room = sizeof reader->pointer - 3;
    bool fits = at < room;
    if (fits)
        out[at++] = '/';
    for (; fits && *key; key++) {
        fits = at < room;
        if (*key == '~' || *key == '/') {
            out[at++] = '~';
            out[at++] = *key == '~' ? '0' : '1';
        } else
            out[at++] = *key;
    }
    out[fits ? at : before] = 0;
    return before;
}

static size_t push_index(struct reader *reader, int index)
{
    char key[16];
    snprintf(key, sizeof key, "%d", index);
    return push(reader, key);
}

static void pop(struct reader *reader, size_t before)
{
    reader->pointer[before] = 0;
}

#define REFUSE(reader, ...) pen_fail((reader)->error, PEN_INVALID, (reader)->pointer, __VA_ARGS__)

static bool refuse_choice(
    struct reader *reader, const char *name, const char *const *choices, const char *given)
{
    struct pen_suggestion suggestion = {given};
    char list[256] = "", end[64];
    for (size_t i = 0, at = 0; choices[i] && at < sizeof list; i++) {
        pen_suggest(&suggestion, choices[i]);
        at += (size_t)snprintf(list + at, sizeof list - at, i ? ", %s" : "%s", choices[i]);
    }
    return REFUSE(reader, "%s cannot be \"%.40s\", only one of %s%s", name, given, list,
        pen_suggest_end(&suggestion, end, sizeof end));
}

static bool read_number(
    struct reader *reader, const struct pen_param *row, const cJSON *node, double *value)
{
    if (!cJSON_IsNumber(node))
        return REFUSE(reader, "%s must be a number.", row->name);
    *value = node->valuedouble;
    return true;
}

static bool read_vector(
    struct reader *reader, const struct pen_param *row, const cJSON *node, double *values)
{
    if (!cJSON_IsArray(node) || cJSON_GetArraySize(node) != row->count)
        return REFUSE(reader, "%s must be an array of %u numbers%s%s.", row->name, row->count,
            row->word ? " or " : "", row->word ? row->word : "");
    int i = 0;
    for (const cJSON *item = node->child; item; item = item->next, i++) {
        size_t before = push_index(reader, i);
        if (!read_number(reader, row, item, &values[i]))
            return false;
        pop(reader, before);
    }
    return true;
}

/* A number stands for its digits: names may be all digits, and flags and queries are text. */
static bool read_text(
    struct reader *reader, const struct pen_param *row, const cJSON *node, void *base)
{
    char digits[16];
    const char *text = node->valuestring;
    if (cJSON_IsNumber(node)) {
        double x = node->valuedouble;
        if (!(x >= 0 && x <= UINT32_MAX && x == floor(x)))
            return REFUSE(reader, "%s must be a name, or a number from 0.", row->name);
        snprintf(digits, sizeof digits, "%.0f", x);
        text = digits;
    } else if (!cJSON_IsString(node))
        return REFUSE(reader, "%s must be a name, or a number from 0.", row->name);
    return pen_param_store_text(row, base, text, reader->pointer, reader->error);
}

static bool read_row(
    struct reader *reader, const struct pen_param *row, const cJSON *node, void *base)
{
    double values[4] = {0};
    if (cJSON_IsString(node) && pen_param_store_word(row, base, node->valuestring))
        return true;
    if (row->type == PEN_PARAM_TEXT)
        return read_text(reader, row, node, base);
    if (row->choices) {
        if (!cJSON_IsString(node))
            return REFUSE(reader, "%s must be a string.", row->name);
        int index = pen_choice_index(row->choices, node->valuestring);
        if (index < 0)
            return refuse_choice(reader, row->name, row->choices, node->valuestring);
        values[0] = index;
    } else if (reader->text && cJSON_IsString(node))
        return pen_param_parse(row, base, node->valuestring, reader->pointer, reader->error);
    else if (row->type == PEN_PARAM_FLAG) {
        if (!cJSON_IsBool(node))
            return REFUSE(reader, "%s must be true%s false%s%s.", row->name,
                row->word ? "," : " or", row->word ? " or " : "", row->word ? row->word : "");
        values[0] = cJSON_IsTrue(node);
    } else if (row->count > 1) {
        if (!read_vector(reader, row, node, values))
            return false;
    } else if (!read_number(reader, row, node, values))
        return false;
    return pen_param_store(row, base, values, reader->pointer, reader->error);
}

static bool is_in(const struct group *group, const struct pen_param *row)
{
    return !(group->only && row->applies != group->only) &&
           !(group->except && row->applies == group->except);
}

static bool refuse_key(struct reader *reader, const char *key, const struct group *groups,
    uint32_t group_count, const struct special *specials, uint32_t special_count)
{
    struct pen_suggestion suggestion = {key};
    char end[64];
    for (uint32_t s = 0; s < special_count; s++)
        pen_suggest(&suggestion, specials[s].key);
    for (uint32_t g = 0; g < group_count; g++)
        for (uint32_t r = 0; r < groups[g].table.count; r++) {
            const struct pen_param *row = &groups[g].table.rows[r];
            if (is_in(&groups[g], row) &&
                (!groups[g].applies || !row->applies || (row->applies & groups[g].applies)))
                pen_suggest(&suggestion, row->name);
        }
    return REFUSE(reader, "There is no key \"%.40s\" here%s", key,
        pen_suggest_end(&suggestion, end, sizeof end));
}

static bool read_key(struct reader *reader, const cJSON *node, const struct group *groups,
    uint32_t group_count, const struct special *specials, uint32_t special_count)
{
    for (uint32_t s = 0; s < special_count; s++)
        if (!strcmp(specials[s].key, node->string))
            return specials[s].read(reader, node, specials[s].object);
    for (uint32_t g = 0; g < group_count; g++) {
        const struct group *group = &groups[g];
        const struct pen_param *row = pen_param_find(group->table, node->string);
        if (!row || !is_in(group, row))
            continue;
        if (group->applies && row->applies && !(row->applies & group->applies))
            return REFUSE(reader, "A %s has no %s.", group->kind, row->name);
        return read_row(reader, row, node, group->base);
    }
    return refuse_key(reader, node->string, groups, group_count, specials, special_count);
}

/* Reads every member of an object. An unknown key ends it, so that looking for repeated ones costs
 * no more than the square of the known. */
static bool read_object(struct reader *reader, const cJSON *node, const struct group *groups,
    uint32_t group_count, const struct special *specials, uint32_t special_count)
{
    if (!cJSON_IsObject(node))
        return REFUSE(reader, "An object is expected here.");
    for (const cJSON *member = node->child; member; member = member->next) {
        size_t before = push(reader, member->string);
        for (const cJSON *other = node->child; other != member; other = other->next)
            if (!strcmp(other->string, member->string))
                return REFUSE(reader, "The key \"%.40s\" is given twice.", member->string);
        if (!read_key(reader, member, groups, group_count, specials, special_count))
            return false;
        pop(reader, before);
    }
    return true;
}

static const cJSON *member_of(const cJSON *object, const char *key)
{
    return cJSON_GetObjectItemCaseSensitive(object, key);
}

static bool read_technique_name(struct reader *reader, const cJSON *node, void *object)
{
    struct pen_request *request = object;
    if (!cJSON_IsString(node))
        return REFUSE(reader, "A method's name must be a string.");
    const struct pen_technique_info *info =
        pen_catalogue_find(reader->catalogue, node->valuestring);
    if (!info) {
        struct pen_suggestion suggestion = {node->valuestring};
        char end[64];
        for (uint32_t i = 0; i < reader->catalogue->count; i++)
            pen_suggest(&suggestion, reader->catalogue->items[i]->name);
        return REFUSE(reader, "There is no method called \"%.40s\"%s", node->valuestring,
            pen_suggest_end(&suggestion, end, sizeof end));
    }
    memset(request->technique, 0, sizeof request->technique);
    memset(request->technique_params, 0, sizeof request->technique_params);
    memcpy(request->technique, info->name, strlen(info->name));
    pen_params_default(info->params, request->technique_params);
    return true;
}

static bool read_technique_params(struct reader *reader, const cJSON *node, void *object)
{
    struct pen_request *request = object;
    const struct pen_technique_info *info =
        pen_catalogue_find(reader->catalogue, request->technique);
    struct group group = {info->params, request->technique_params};
    return read_object(reader, node, &group, 1, NULL, 0);
}

static bool already_read(struct reader *reader, const cJSON *node, void *object)
{
    (void)reader, (void)node, (void)object;
    return true;
}

static bool read_technique(struct reader *reader, const cJSON *node, void *object)
{
    if (cJSON_IsString(node))
        return read_technique_name(reader, node, object);
    if (!cJSON_IsObject(node))
        return REFUSE(reader, "technique must be a method's name or an object.");
    /* The name comes first, wherever it stands: the parameters depend on it. */
    const cJSON *name = member_of(node, "name");
    if (name) {
        size_t before = push(reader, "name");
        if (!read_technique_name(reader, name, object))
            return false;
        pop(reader, before);
    }
    struct special specials[] = {
        {"name", already_read, object}, {"params", read_technique_params, object}};
    return read_object(reader, node, NULL, 0, specials, 2);
}

static bool read_orbit(struct reader *reader, const cJSON *node, void *object)
{
    struct group group = {pen_camera_table(), object, .only = PEN_CAMERA_BIT(PEN_CAMERA_ORBIT)};
    return read_object(reader, node, &group, 1, NULL, 0);
}

static bool read_camera(struct reader *reader, const cJSON *node, void *object)
{
    static const struct {
        const char *key, *kind;
        enum pen_camera_mode mode;
    } modes[] = {
        {"index", "camera of the scene (index)", PEN_CAMERA_INDEX},
        {"orbit", "camera in orbit", PEN_CAMERA_ORBIT},
        {"eye", "camera with an eye", PEN_CAMERA_LOOK_AT},
    };
    struct pen_camera *camera = object;
    const char *kind = "camera without an eye", *chosen = NULL;
    if (!cJSON_IsObject(node))
        return REFUSE(reader, "camera must be an object.");
    for (uint32_t m = 0; m < sizeof modes / sizeof *modes; m++) {
        if (!member_of(node, modes[m].key))
            continue;
        if (chosen) {
            push(reader, modes[m].key);
            return REFUSE(reader, "%s and %s exclude each other.", chosen, modes[m].key);
        }
        chosen = modes[m].key;
        kind = modes[m].kind;
        camera->mode = modes[m].mode;
    }
    struct group group = {pen_camera_table(), camera, .applies = PEN_CAMERA_BIT(camera->mode),
        .except = PEN_CAMERA_BIT(PEN_CAMERA_ORBIT), .kind = kind};
    struct special orbit = {"orbit", read_orbit, camera};
    return read_object(reader, node, &group, 1, &orbit, 1);
}

static bool read_pattern(struct reader *reader, const cJSON *node, void *object)
{
    struct pen_light *light = object;
    if (!cJSON_IsString(node))
        return REFUSE(reader, "pattern must be a string.");
    int index = pen_choice_index(pen_pattern_names, node->valuestring);
    if (index < 0)
        return refuse_choice(reader, "pattern", pen_pattern_names, node->valuestring);
    light->texture = PEN_TEXTURE_PATTERN;
    light->pattern = (uint32_t)index;
    return true;
}

static bool read_image(struct reader *reader, const cJSON *node, void *object)
{
    struct pen_light *light = object;
    uint8_t id[PEN_ID_BYTES];
    if (!cJSON_IsString(node) || !pen_id_from_hex(node->valuestring, id))
        return REFUSE(
            reader, "image must be the id of an image: 64 lower-case hexadecimal digits.");
    light->texture = PEN_TEXTURE_IMAGE;
    memcpy(light->image, id, sizeof id);
    return true;
}

static bool read_texture(struct reader *reader, const cJSON *node, void *object)
{
    struct pen_light *light = object;
    if (light->type != PEN_LIGHT_RECT)
        return REFUSE(reader, "A %s light has no texture.", pen_light_type_names[light->type]);
    struct special specials[] = {{"image", read_image, light}, {"pattern", read_pattern, light}};
    if (!read_object(reader, node, NULL, 0, specials, 2))
        return false;
    if (!node->child || node->child->next)
        return REFUSE(reader, "A texture is either an image or a pattern.");
    return true;
}

static bool read_light_type(struct reader *reader, const cJSON *node, uint32_t *type)
{
    *type = PEN_LIGHT_RECT;
    const cJSON *name = member_of(node, "type");
    if (!name)
        return true;
    size_t before = push(reader, "type");
    if (!cJSON_IsString(name))
        return REFUSE(reader, "type must be a string.");
    int index = pen_choice_index(pen_light_type_names, name->valuestring);
    if (index < 0)
        return refuse_choice(reader, "type", pen_light_type_names, name->valuestring);
    pop(reader, before);
    *type = (uint32_t)index;
    return true;
}

static bool read_light(struct reader *reader, const cJSON *node, struct pen_light *light)
{
    uint32_t type;
    char kind[24];
    if (!cJSON_IsObject(node))
        return REFUSE(reader, "A light must be an object.");
    if (!read_light_type(reader, node, &type))
        return false;
    pen_light_default(light, type);
    snprintf(kind, sizeof kind, "%s light", pen_light_type_names[type]);
    struct group group = {pen_light_table(), light, .applies = PEN_LIGHT_BIT(type), .kind = kind};
    struct special specials[] = {{"type", already_read, light}, {"texture", read_texture, light}};
    if (!read_object(reader, node, &group, 1, specials, 2))
        return false;
    if (member_of(node, "radiance")) {
        if (member_of(node, "power_w")) {
            push(reader, "radiance");
            return REFUSE(reader, "power_w and radiance exclude each other.");
        }
        light->power_w = 0;
    }
    return true;
}

static bool read_lights(struct reader *reader, const cJSON *node, void *object)
{
    struct pen_request *request = object;
    if (!cJSON_IsArray(node))
        return REFUSE(reader, "lights must be an array.");
    request->lights_given = 1;
    int i = 0;
    for (const cJSON *item = node->child; item; item = item->next, i++) {
        if (i == PEN_MAX_LIGHTS)
            return REFUSE(reader, "At most %d lights are allowed.", PEN_MAX_LIGHTS);
        size_t before = push_index(reader, i);
        if (!read_light(reader, item, &request->lights[i]))
            return false;
        pop(reader, before);
    }
    request->light_count = (uint32_t)i;
    return true;
}

static bool read_output(struct reader *reader, const cJSON *node, void *object)
{
    struct group group = {pen_output_table(), object};
    return read_object(reader, node, &group, 1, NULL, 0);
}

bool pen_request_from_tree(const cJSON *root, bool text, const struct pen_catalogue *catalogue,
    struct pen_request *request, struct pen_error *error)
{
    struct reader reader = {catalogue, error, text};
    pen_request_default(request, catalogue);
    struct group groups[] = {
        {pen_request_table(), request}, {pen_delivery_table(), &request->delivery}};
    struct special specials[] = {{"technique", read_technique, request},
        {"camera", read_camera, &request->camera}, {"lights", read_lights, request},
        {"output", read_output, &request->output}};
    return read_object(&reader, root, groups, 2, specials, 4) &&
           pen_request_check(request, catalogue, error);
}

bool pen_rows_from_tree(const cJSON *node, struct pen_param_table table, void *object,
    const char *pointer, struct pen_error *error)
{
    struct reader reader = {.error = error};
    struct group group = {table, object};
    snprintf(reader.pointer, sizeof reader.pointer, "%s", pointer);
    return read_object(&reader, node, &group, 1, NULL, 0);
}

bool pen_request_from_json(const char *text, size_t bytes, const struct pen_catalogue *catalogue,
    struct pen_request *request, struct pen_error *error)
{
    if (bytes > PEN_MAX_JSON_BYTES)
        return pen_fail(
            error, PEN_TOO_BIG, "", "A request may have at most %d bytes.", PEN_MAX_JSON_BYTES);
    if (!bytes)
        return pen_fail(error, PEN_MALFORMED, "",
            "The body is empty; an empty object, {}, asks for every default.");
    if (!pen_json_scan(text, bytes, PEN_MAX_JSON_DEPTH, error))
        return false;
    cJSON *root = cJSON_ParseWithLength(text, bytes);
    if (!root)
        return pen_fail(error, PEN_MALFORMED, "", "Malformed JSON.");
    bool ok = pen_request_from_tree(root, false, catalogue, request, error);
    cJSON_Delete(root);
    return ok;
}
