#include "protocol/json_reader.h"
#include "protocol/json_request.h"
#include "protocol/utf8.h"
#include <stdio.h>
#include <string.h>

#define MAX_PAIRS 256
#define MAX_SEGMENTS 5
#define MAX_PATH 160

static bool is_technique(const char *key)
{
    return !strcmp(key, "technique") || !strcmp(key, "technique.name");
}

/* The method that the bare names of parameters belong to. */
static const struct pen_technique_info *find_technique(
    const struct pen_query_pair *pairs, uint32_t count, const struct pen_catalogue *catalogue)
{
    struct pen_request defaults;
    for (uint32_t i = 0; i < count; i++)
        if (pairs[i].value && is_technique(pairs[i].key))
            return pen_catalogue_find(catalogue, pairs[i].value);
    pen_request_default(&defaults, catalogue);
    return pen_catalogue_find(catalogue, defaults.technique);
}

static bool starts_with(const char *text, const char *prefix)
{
    return !strncmp(text, prefix, strlen(prefix));
}

/* A bare name that a field of the request has too is the method's when the value is one of the words
 * that the method's parameter knows, or when it says how the answer is wanted. */
static bool is_word_of_method(
    const struct pen_technique_info *info, const char *key, const char *value)
{
    const struct pen_param *row = info ? pen_param_find(info->params, key) : NULL;
    if (row && !row->choices)
        return pen_param_find(pen_delivery_table(), key) != NULL;
    return row && value && pen_choice_index(row->choices, value) >= 0;
}

/* Writes the path in the JSON body that `key` is short for. */
static void expand(
    const char *key, const char *value, const struct pen_technique_info *info, char path[MAX_PATH])
{
    const char *prefix = "";
    if (!strcmp(key, "technique"))
        key = "technique.name";
    else if (starts_with(key, "params."))
        prefix = "technique.";
    else if (starts_with(key, "light.")) {
        prefix = "lights.0.";
        key += strlen("light.");
    } else if (is_word_of_method(info, key, value)) {
        prefix = "technique.params.";
    } else if (!pen_param_find(pen_request_table(), key) &&
               !pen_param_find(pen_delivery_table(), key)) {
        if (pen_param_find(pen_output_table(), key))
            prefix = "output.";
        else if (info && pen_param_find(info->params, key))
            prefix = "technique.params.";
    }
    snprintf(path, MAX_PATH, "%s%s", prefix, key);
}

/* As in a body: what is taken can be written down and reads back the same. */
static bool require_utf8(const struct pen_query_pair *pair, struct pen_error *error)
{
    if (!pen_is_utf8(pair->key, strlen(pair->key)))
        return pen_fail(
            error, PEN_MALFORMED, "", "A query key is not UTF-8: \"%.60s\".", pair->key);
    if (pair->value && !pen_is_utf8(pair->value, strlen(pair->value)))
        return pen_fail(error, PEN_MALFORMED, "",
            "The value of the query key \"%.60s\" is not UTF-8.", pair->key);
    return true;
}

static bool refuse_key(struct pen_error *error, const char *key)
{
    return pen_fail(error, PEN_INVALID, "", "There is no query key \"%.60s\".", key);
}

/* Puts a leaf at `path`, making objects on the way. */
static bool insert(
    cJSON *root, char *path, const char *key, const char *value, struct pen_error *error)
{
    cJSON *object = root;
    for (int segment = 0; segment < MAX_SEGMENTS; segment++) {
        char *dot = strchr(path, '.');
        if (dot)
            *dot = 0;
        if (!*path)
            return refuse_key(error, key);
        cJSON *member = cJSON_GetObjectItemCaseSensitive(object, path);
        if (member && (!dot || !cJSON_IsObject(member)))
            return pen_fail(error, PEN_INVALID, "",
                "The query key \"%.60s\" is given twice, or as a value and a path.", key);
        if (!dot) {
            cJSON_AddStringToObject(object, path, value ? value : "");
            return true;
        }
        object = member ? member : cJSON_AddObjectToObject(object, path);
        path = dot + 1;
    }
    return refuse_key(error, key);
}

/* {"0": {...}, "1": {...}} becomes an array; "none" an empty one. */
static bool make_array(cJSON *root, struct pen_error *error)
{
    cJSON *lights = cJSON_DetachItemFromObjectCaseSensitive(root, "lights");
    if (!lights)
        return true;
    cJSON *array = cJSON_AddArrayToObject(root, "lights");
    bool ok = cJSON_IsObject(lights) || !strcmp(lights->valuestring, "none");
    if (!ok)
        pen_fail(error, PEN_INVALID, "/lights",
            "In a query, lights is \"none\" or lights.0.type and so on.");
    for (int i = 0; ok && lights->child; i++) {
        char index[12];
        snprintf(index, sizeof index, "%d", i);
        cJSON *light = cJSON_DetachItemFromObjectCaseSensitive(lights, index);
        if (light) {
            cJSON_AddItemToArray(array, light);
            continue;
        }
        ok = pen_fail(error, PEN_INVALID, "/lights",
            "Lights are numbered 0, 1, 2 and so on: \"%.20s\" is given, but not %d.",
            lights->child->string, i);
    }
    cJSON_Delete(lights);
    return ok;
}

bool pen_request_from_query(const struct pen_query_pair *pairs, uint32_t count,
    const struct pen_catalogue *catalogue, struct pen_request *request, struct pen_error *error)
{
    if (count > MAX_PAIRS)
        return pen_fail(error, PEN_MALFORMED, "", "A query may have at most %d keys.", MAX_PAIRS);
    for (uint32_t i = 0; i < count; i++)
        if (!require_utf8(&pairs[i], error))
            return false;
    for (uint32_t i = 0; i < count; i++) {
        if (strcmp(pairs[i].key, "request"))
            continue;
        if (count > 1)
            return pen_fail(error, PEN_INVALID, "",
                "The query key \"request\" is a whole request and excludes every other key.");
        const char *text = pairs[i].value ? pairs[i].value : "";
        return pen_request_from_json(text, strlen(text), catalogue, request, error);
    }
    const struct pen_technique_info *info = find_technique(pairs, count, catalogue);
    cJSON *root = cJSON_CreateObject();
    bool ok = root != NULL || pen_fail(error, PEN_UNAVAILABLE, "", "Out of memory.");
    /* The method first: an unknown one must not be reported as unknown parameters. */
    for (uint32_t n = 0; ok && n < 2 * count; n++) {
        uint32_t i = n % count;
        char path[MAX_PATH];
        if (is_technique(pairs[i].key) != (n < count))
            continue;
        if (strlen(pairs[i].key) > MAX_PATH / 2)
            ok = refuse_key(error, pairs[i].key);
        else {
            expand(pairs[i].key, pairs[i].value, info, path);
            ok = insert(root, path, pairs[i].key, pairs[i].value, error);
        }
    }
    ok = ok && make_array(root, error) &&
         pen_request_from_tree(root, true, catalogue, request, error);
    cJSON_Delete(root);
    return ok;
}
