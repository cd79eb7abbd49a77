/* The OpenAPI document: it parses, its references lead somewhere, every row is in it once. */
#include "protocol/json_scan.h"
#include "protocol/openapi.h"
#include "protocol/routes.h"
#include "tests/unit/check.h"
#include "tests/unit/documents_catalogue.h"
#include <cjson/cJSON.h>

static const cJSON *root;
static uint32_t refs, described;

static const cJSON *member(const cJSON *object, const char *key)
{
    return cJSON_GetObjectItemCaseSensitive(object, key);
}

/* "#/a/b/0": a member or an item of the document, or NULL. */
static const cJSON *resolve(const char *pointer)
{
    char copy[256], *save = NULL;
    const cJSON *node = root;
    snprintf(copy, sizeof copy, "%s", pointer);
    for (char *token = strtok_r(copy + 1, "/", &save); token && node;
         token = strtok_r(NULL, "/", &save)) {
        char key[256] = "", *out = key;
        for (char *in = token; *in; in++)
            *out++ = in[0] == '~' ? (*++in == '1' ? '/' : '~') : *in;
        node = cJSON_IsArray(node) ? cJSON_GetArrayItem(node, atoi(key)) : member(node, key);
    }
    return node;
}

/* Checks the references below `node`, and that no object has a key twice. */
static void walk(const cJSON *node)
{
    for (const cJSON *child = node->child; child; child = child->next) {
        if (child->string && !strcmp(child->string, "$ref")) {
            refs++;
            /* Generators of clients do not follow these. */
            CHECK(!strstr(child->valuestring, "/properties/"));
            if (!cJSON_IsString(child) || !resolve(child->valuestring))
                fprintf(stderr, "dangling: %s\n", child->valuestring), check_failures++;
        }
        for (const cJSON *other = node->child; child->string && other != child; other = other->next)
            CHECK(strcmp(other->string, child->string));
        walk(child);
    }
}

static void count_help(const cJSON *node, const char *help)
{
    for (const cJSON *child = node->child; child; child = child->next) {
        if (child->string && !strcmp(child->string, "description") && cJSON_IsString(child) &&
            !strncmp(child->valuestring, help, strlen(help)))
            described++;
        count_help(child, help);
    }
}

static void check_row(const struct pen_param *row, const char *where)
{
    char pointer[200];
    snprintf(pointer, sizeof pointer, "#/components/schemas/%s/properties/%s", where, row->name);
    const cJSON *schema = resolve(pointer);
    if (!schema) {
        fprintf(stderr, "no %s\n", pointer);
        check_failures++;
        return;
    }
    described = 0;
    count_help(root, row->help);
    CHECK(described >= 1);
    const cJSON *value = member(schema, "default"), *one = schema, *described_by = schema;
    if (row->word) { /* instead of the other */
        const cJSON *kinds = member(schema, "anyOf");
        CHECK_STR(cJSON_GetArrayItem(member(cJSON_GetArrayItem(kinds, 1), "enum"), 0)->valuestring,
            row->word);
        one = schema = cJSON_GetArrayItem(kinds, 0);
    }
    CHECK((value != NULL) != row->automatic); /* what is chosen to suit has no default */
    if (row->count > 1) {
        one = member(schema, "items");
        CHECK_STR(member(schema, "type")->valuestring, "array");
        CHECK(row->automatic || cJSON_GetArraySize(value) == row->count);
        CHECK(row->automatic || cJSON_GetArrayItem(value, 1)->valuedouble == row->def_v[1]);
        CHECK(member(schema, "minItems")->valueint == row->count);
        CHECK(member(schema, "maxItems")->valueint == row->count);
    } else if (row->choices) {
        CHECK_STR(value->valuestring, row->choices[(int)row->def]);
        CHECK_STR(cJSON_GetArrayItem(member(schema, "enum"), 0)->valuestring, row->choices[0]);
        return;
    } else if (row->type == PEN_PARAM_FLAG) {
        CHECK(cJSON_IsBool(value) && cJSON_IsTrue(value) == (row->def != 0));
        return;
    } else if (row->type == PEN_PARAM_TEXT) {
        CHECK_STR(value->valuestring, "");
        CHECK_STR(cJSON_GetArrayItem(member(schema, "type"), 0)->valuestring, "string");
        return;
    } else
        CHECK(row->automatic || value->valuedouble == row->def);
    CHECK_STR(member(one, "type")->valuestring, pen_param_is_real(row) ? "number" : "integer");
    CHECK_NEAR(
        member(one, row->exclusive_min ? "exclusiveMinimum" : "minimum")->valuedouble, row->min, 0);
    CHECK_NEAR(member(one, "maximum")->valuedouble, row->max, 0);
    if (row->unit)
        CHECK_STR(member(described_by, "x-unit")->valuestring, row->unit);
}

static void check_table(struct pen_param_table table, const char *where)
{
    for (uint32_t r = 0; r < table.count; r++)
        check_row(&table.rows[r], where);
}

int main(void)
{
    char *text = pen_openapi_json(&fake_catalogue, "1.2.3");
    struct pen_error error = {0};
    CHECK(pen_json_scan(text, strlen(text), 32, &error));
    root = cJSON_Parse(text);
    CHECK(root != NULL);
    CHECK_STR(member(root, "openapi")->valuestring, "3.1.0");
    CHECK_STR(resolve("#/info/version")->valuestring, "1.2.3");
    walk(root);
    CHECK(refs > 100);

    check_table(pen_request_table(), "RenderRequest");
    check_table(pen_delivery_table(), "RenderRequest");
    check_table(pen_output_table(), "Output");
    check_table(pen_light_table(), "Light");
    struct pen_param_table camera = pen_camera_table();
    for (uint32_t r = 0; r < camera.count; r++)
        check_row(&camera.rows[r], camera.rows[r].applies == PEN_CAMERA_BIT(PEN_CAMERA_ORBIT)
                                       ? "Camera/properties/orbit"
                                       : "Camera");
    check_table(fake_catalogue.items[2]->params, "Technique-pcss/properties/params");
    check_table(fake_catalogue.items[1]->params, "Technique-hard/properties/params");
    CHECK_STR(resolve("#/components/schemas/TechniqueName/default")->valuestring, "pcss");

    /* A sun takes no width: the schema says so. */
    const cJSON *sun = resolve("#/components/schemas/Light/allOf/3");
    CHECK_STR(
        resolve("#/components/schemas/Light/allOf/3/if/properties/type/const")->valuestring, "sun");
    CHECK(cJSON_IsFalse(member(member(member(sun, "then"), "properties"), "width")));
    CHECK(!member(member(member(sun, "then"), "properties"), "irradiance"));

    const cJSON *paths = member(root, "paths");
    for (uint32_t r = 0; r < PEN_ROUTES; r++) {
        char method[8] = "";
        for (int i = 0; pen_routes[r].method[i]; i++)
            method[i] = (char)(pen_routes[r].method[i] | 0x20);
        const cJSON *operation = member(member(paths, pen_routes[r].pattern), method);
        CHECK(operation != NULL);
        CHECK_STR(member(operation, "operationId")->valuestring, pen_routes[r].operation);
        CHECK(member(member(operation, "responses"), "default") != NULL);
        CHECK(!!member(operation, "requestBody") == (pen_routes[r].takes != PEN_BODY_NONE));
    }
    /* Query keys are unique. */
    const cJSON *queries = resolve("#/paths/~1v1~1scenes~1{id}~1render/get/parameters");
    CHECK(cJSON_GetArraySize(queries) > 40);
    for (const cJSON *a = queries->child; a; a = a->next)
        for (const cJSON *b = queries->child; b != a; b = b->next)
            CHECK(strcmp(member(a, "name")->valuestring, member(b, "name")->valuestring));
    cJSON_Delete((cJSON *)root);
    free(text);
    CHECK_DONE();
}
