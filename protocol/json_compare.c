#include "protocol/json_compare.h"
#include "protocol/json_reader.h"
#include "protocol/json_scan.h"
#include <stdio.h>
#include <string.h>

#define REFERENCE_SAMPLES 1024

struct reader {
    const struct pen_catalogue *catalogue;
    const char *excluded;
    struct pen_error *error;
};

/* "/technique/params/x" of the request that stands for one
 * method becomes "/techniques/3/params/x". */
static bool move_pointer(struct pen_error *error, const char *to)
{
    static const char from[] = "/technique";
    char moved[sizeof error->pointer];
    char next = error->pointer[strnlen(error->pointer, sizeof from - 1)];
    if (!strncmp(error->pointer, from, sizeof from - 1) && (!next || next == '/')) {
        snprintf(moved, sizeof moved, "%s%s", to, error->pointer + sizeof from - 1);
        memcpy(error->pointer, moved, sizeof moved);
    }
    return false;
}

/* Reads the whole body once per method, with that method in the place of "technique". */
static bool read_method(const struct reader *reader, cJSON *root, cJSON *method,
    const char *pointer, struct pen_request *request)
{
    cJSON_AddItemReferenceToObject(root, "technique", method);
    bool ok = pen_request_from_tree(root, false, reader->catalogue, request, reader->error) ||
              move_pointer(reader->error, pointer);
    cJSON_DeleteItemFromObjectCaseSensitive(root, "technique");
    if (ok && reader->excluded && !strcmp(request->technique, reader->excluded))
        return pen_fail(reader->error, PEN_INVALID, pointer,
            "%s stands for another method: it cannot be compared.", reader->excluded);
    return ok;
}

/* The default reference: as many light samples as a reference needs. */
static cJSON *make_reference(const char *name)
{
    cJSON *reference = cJSON_CreateObject();
    cJSON_AddStringToObject(reference, "name", name);
    cJSON_AddNumberToObject(
        cJSON_AddObjectToObject(reference, "params"), "samples", REFERENCE_SAMPLES);
    return reference;
}

static const char *name_of(const cJSON *method)
{
    const cJSON *name =
        cJSON_IsObject(method) ? cJSON_GetObjectItemCaseSensitive(method, "name") : method;
    return cJSON_IsString(name) ? name->valuestring : NULL;
}

/* Gives the reference its default samples where the body does not say; replaces one that this build
 * does not have. Takes `given`, which may be NULL. */
static cJSON *complete_reference(
    const struct reader *reader, cJSON *given, struct pen_compare *compare)
{
    static const char traced[] = "raytraced", sampled[] = "multisample";
    bool has_traced = pen_catalogue_find(reader->catalogue, traced) != NULL;
    const char *name = given ? name_of(given) : traced;
    bool is_traced = name && !strcmp(name, traced);
    if (is_traced && !has_traced) {
        snprintf(compare->warning, sizeof compare->warning,
            "This build has no %s: the reference is %s with %d samples.", traced, sampled,
            REFERENCE_SAMPLES);
        cJSON_Delete(given);
        return make_reference(sampled);
    }
    bool bare = given && cJSON_IsString(given);
    if (!given || (bare && (is_traced || (name && !strcmp(name, sampled))))) {
        cJSON *reference = make_reference(name);
        cJSON_Delete(given);
        return reference;
    }
    return given;
}

static bool read_all(const struct reader *reader, cJSON *root, struct pen_compare *compare)
{
    for (uint32_t i = 0; i < reader->catalogue->count; i++) {
        const char *name = reader->catalogue->items[i]->name;
        if (!strcmp(name, compare->requests[0].technique) ||
            (reader->excluded && !strcmp(name, reader->excluded)) ||
            compare->count == PEN_COMPARE_METHODS)
            continue;
        cJSON *method = cJSON_CreateString(name);
        bool ok =
            read_method(reader, root, method, "/techniques", &compare->requests[++compare->count]);
        cJSON_Delete(method);
        if (!ok)
            return false;
    }
    return true;
}

static bool read_list(
    const struct reader *reader, cJSON *root, cJSON *list, struct pen_compare *compare)
{
    int count = cJSON_GetArraySize(list);
    if (!cJSON_IsArray(list) || count < 1 || count > PEN_COMPARE_METHODS)
        return pen_fail(reader->error, PEN_INVALID, "/techniques",
            "techniques must be \"all\" or a list of 1 to %d methods.", PEN_COMPARE_METHODS);
    for (cJSON *item = list->child; item; item = item->next) {
        char pointer[32];
        snprintf(pointer, sizeof pointer, "/techniques/%u", compare->count);
        if (!read_method(reader, root, item, pointer, &compare->requests[++compare->count]))
            return false;
    }
    return true;
}

static bool read_root(const struct reader *reader, cJSON *root, struct pen_compare *compare)
{
    static const struct {
        const char *key, *pointer, *message;
    } refused[] = {
        {"technique", "/technique", "A comparison takes techniques, a list, and reference."},
        {"output", "/output", "A comparison chooses its outputs itself."},
    };
    if (!cJSON_IsObject(root))
        return pen_fail(reader->error, PEN_INVALID, "", "An object is expected here.");
    for (size_t i = 0; i < sizeof refused / sizeof *refused; i++)
        if (cJSON_GetObjectItemCaseSensitive(root, refused[i].key))
            return pen_fail(
                reader->error, PEN_INVALID, refused[i].pointer, "%s", refused[i].message);
    cJSON *list = cJSON_DetachItemFromObjectCaseSensitive(root, "techniques");
    cJSON *reference = complete_reference(
        reader, cJSON_DetachItemFromObjectCaseSensitive(root, "reference"), compare);
    static const char *const twice[] = {"techniques", "reference"};
    for (int i = 0; i < 2; i++)
        if (cJSON_GetObjectItemCaseSensitive(root, twice[i])) {
            char pointer[32];
            snprintf(pointer, sizeof pointer, "/%s", twice[i]);
            cJSON_Delete(list);
            cJSON_Delete(reference);
            return pen_fail(
                reader->error, PEN_INVALID, pointer, "The key \"%s\" is given twice.", twice[i]);
        }
    bool all = !list || (cJSON_IsString(list) && !strcmp(list->valuestring, "all"));
    bool ok = read_method(reader, root, reference, "/reference", &compare->requests[0]) &&
              (all ? read_all(reader, root, compare) : read_list(reader, root, list, compare));
    cJSON_Delete(list);
    cJSON_Delete(reference);
    if (ok &&
        (uint64_t)compare->requests[0].width * compare->requests[0].height > PEN_COMPARE_PIXELS)
        return pen_fail(reader->error, PEN_INVALID, "/width", "A comparison has at most %u pixels.",
            PEN_COMPARE_PIXELS);
    return ok;
}

bool pen_compare_from_json(const char *text, size_t bytes, const struct pen_catalogue *catalogue,
    const char *excluded, struct pen_compare *compare, struct pen_error *error)
{
    struct reader reader = {catalogue, excluded, error};
    memset(compare, 0, sizeof *compare);
    if (bytes > PEN_MAX_JSON_BYTES)
        return pen_fail(
            error, PEN_TOO_BIG, "", "A request may have at most %d bytes.", PEN_MAX_JSON_BYTES);
    if (!pen_json_scan(text, bytes, PEN_MAX_JSON_DEPTH, error))
        return false;
    cJSON *root = cJSON_ParseWithLength(text, bytes);
    bool ok = root ? read_root(&reader, root, compare)
                   : pen_fail(error, PEN_MALFORMED, "", "Malformed JSON.");
    cJSON_Delete(root);
    return ok;
}

/* ---- the answer ---- */

static void write_links(struct pen_json *json, const struct pen_compared *row)
{
    const struct {
        const char *key, *href;
    } links[] = {{"image", row->image}, {"difference", row->difference},
        {"ssim_map", row->ssim_map}, {"flip_map", row->flip_map}};
    pen_json_object(json, "links");
    for (size_t i = 0; i < sizeof links / sizeof *links; i++)
        if (links[i].href)
            pen_json_link(json, links[i].key, links[i].href);
    pen_json_end(json);
}

static void write_comparison(struct pen_json *json, const struct pen_comparison *c)
{
    pen_json_float(json, "rmse", (float)c->rmse);
    if (c->penumbra_pixels)
        pen_json_float(json, "rmse_penumbra", (float)c->penumbra_rmse);
    else
        pen_json_null(json, "rmse_penumbra");
    pen_json_array(json, "rmse_channels");
    for (int i = 0; i < 3; i++)
        pen_json_float(json, NULL, (float)c->channel_rmse[i]);
    pen_json_end(json);
    pen_json_float(json, "mean_error", (float)c->mean_error);
    pen_json_float(json, "largest_error", (float)c->largest);
    pen_json_float(json, "rmse_picture", (float)c->picture_rmse);
    pen_json_float(json, "ssim", (float)c->ssim);
    pen_json_float(json, "ssim_contrast", (float)c->ssim_contrast);
    pen_json_float(json, "flip", (float)c->flip);
    pen_json_uint(json, "penumbra_pixels", c->penumbra_pixels);
}

static void write_row(struct pen_json *json, const char *key, const struct pen_compared *row,
    const struct pen_request *request, const struct pen_catalogue *catalogue, bool is_reference)
{
    const struct pen_result *result = row->result;
    const struct pen_technique_info *info = pen_catalogue_find(catalogue, request->technique);
    pen_json_object(json, key);
    pen_json_object(json, "technique");
    pen_json_string(json, "name", request->technique);
    pen_json_object(json, "params");
    for (uint32_t r = 0; r < info->params.count; r++)
        pen_json_row(json, &info->params.rows[r], request->technique_params);
    pen_json_end(json);
    pen_json_end(json);
    if (result->error.code != PEN_OK) {
        pen_json_string(json, "error", result->error.message);
        pen_json_end(json);
        return;
    }
    if (!is_reference)
        write_comparison(json, &result->comparison);
    double ms = 0;
    for (int s = PEN_STAGE_GBUFFER; s <= PEN_STAGE_SHADE; s++)
        ms += result->stage_ms[s];
    pen_json_float(json, "total_ms", (float)ms);
    pen_json_float(json, "shadow_ms",
        result->stage_ms[PEN_STAGE_SHADOW] + result->stage_ms[PEN_STAGE_TECHNIQUE]);
    pen_result_write_times(json, result);
    pen_json_array(json, "warnings");
    for (uint32_t w = 0; w < result->warning_count && w < PEN_MAX_WARNINGS; w++)
        pen_json_string(json, NULL, result->warnings[w]);
    pen_json_end(json);
    write_links(json, row);
    pen_json_end(json);
}

char *pen_compared_json(const struct pen_compare *compare, const struct pen_compared *row,
    uint32_t number, const struct pen_catalogue *catalogue)
{
    struct pen_json json = {0};
    write_row(&json, NULL, row, &compare->requests[number], catalogue, number == 0);
    return pen_json_finish(&json, NULL);
}

char *pen_compare_json(const struct pen_compare *compare, const struct pen_compared *rows,
    const char *request_id, double total_ms, const struct pen_catalogue *catalogue)
{
    struct pen_json json = {0};
    const struct pen_result *first = rows[0].result;
    pen_json_object(&json, NULL);
    if (request_id)
        pen_json_string(&json, "request_id", request_id);
    pen_json_id(&json, "scene", first->completed.scene);
    pen_request_write(&json, "request", &first->completed, catalogue);
    pen_result_write_device(&json, "device", &first->device);
    pen_json_array(&json, "warnings");
    if (*compare->warning)
        pen_json_string(&json, NULL, compare->warning);
    pen_json_end(&json);
    write_row(&json, "reference", &rows[0], &compare->requests[0], catalogue, true);
    pen_json_array(&json, "methods");
    for (uint32_t i = 0; i < compare->count; i++)
        write_row(&json, NULL, &rows[1 + i], &compare->requests[1 + i], catalogue, false);
    pen_json_end(&json);
    pen_json_float(&json, "total_ms", (float)total_ms);
    pen_json_end(&json);
    return pen_json_finish(&json, NULL);
}
