#include "protocol/openapi_schema.h"
#include "protocol/json_sequence.h"
#include "protocol/result.h"
#include <stdio.h>
#include <string.h>

#define SCHEMA "#/components/schemas/"

static void write_ref(struct pen_json *json, const char *key, const char *target)
{
    pen_json_object(json, key);
    pen_json_string(json, "$ref", target);
    pen_json_end(json);
}

static void write_strings(struct pen_json *json, const char *key, const char *const *strings)
{
    pen_json_array(json, key);
    for (uint32_t i = 0; strings[i]; i++)
        pen_json_string(json, NULL, strings[i]);
    pen_json_end(json);
}

/* An object that takes no other keys, with its properties open. */
static void open_object(struct pen_json *json, const char *key, const char *description)
{
    pen_json_object(json, key);
    pen_json_string(json, "type", "object");
    if (description)
        pen_json_string(json, "description", description);
    pen_json_bool(json, "additionalProperties", false);
    pen_json_object(json, "properties");
}

static void close_object(struct pen_json *json)
{
    pen_json_end(json);
    pen_json_end(json);
}

/* Type and range of one component. */
static void write_component(struct pen_json *json, const struct pen_param *row)
{
    if (row->choices) {
        pen_json_string(json, "type", "string");
        write_strings(json, "enum", row->choices);
    } else if (row->type == PEN_PARAM_FLAG)
        pen_json_string(json, "type", "boolean");
    else if (row->type == PEN_PARAM_TEXT) {
        static const char *const types[] = {"string", "integer", NULL};
        write_strings(json, "type", types);
    } else {
        pen_json_string(json, "type", pen_param_is_real(row) ? "number" : "integer");
        pen_json_double(json, row->exclusive_min ? "exclusiveMinimum" : "minimum", row->min);
        pen_json_double(json, "maximum", row->max);
    }
}

static void write_value(struct pen_json *json, const struct pen_param *row)
{
    if (row->count > 1) {
        pen_json_string(json, "type", "array");
        pen_json_object(json, "items");
        write_component(json, row);
        pen_json_end(json);
        pen_json_uint(json, "minItems", row->count);
        pen_json_uint(json, "maxItems", row->count);
    } else
        write_component(json, row);
}

void pen_openapi_row(struct pen_json *json, const char *key, const struct pen_param *row)
{
    char description[2048]; /* a layer more is a sentence more */
    pen_json_object(json, key);
    if (row->word) {
        const char *const words[] = {row->word, NULL};
        pen_json_array(json, "anyOf");
        pen_json_object(json, NULL);
        write_value(json, row);
        pen_json_end(json);
        pen_json_object(json, NULL);
        pen_json_string(json, "type", "string");
        write_strings(json, "enum", words);
        pen_json_end(json);
        pen_json_end(json);
    } else
        write_value(json, row);
    pen_json_row_default(json, "default", row);
    snprintf(description, sizeof description, row->unit ? "%s Unit: %s." : "%s", row->help,
        row->unit ? row->unit : "");
    pen_json_string(json, "description", description);
    if (row->unit)
        pen_json_string(json, "x-unit", row->unit);
    pen_json_end(json);
}

static void write_rows(struct pen_json *json, struct pen_param_table table)
{
    for (uint32_t r = 0; r < table.count; r++)
        pen_openapi_row(json, table.rows[r].name, &table.rows[r]);
}

/* {"required": [a, b]}: both keys are there. */
static void write_both(struct pen_json *json, const char *key, const char *a, const char *b)
{
    const char *const keys[] = {a, b, NULL};
    pen_json_object(json, key);
    write_strings(json, "required", keys);
    pen_json_end(json);
}

/* "properties" that forbids the rows which the bit does not have. */
static void forbid_rows(struct pen_json *json, struct pen_param_table table, uint32_t bit,
    uint32_t except, const char *also)
{
    pen_json_object(json, "properties");
    for (uint32_t r = 0; r < table.count; r++)
        if (table.rows[r].applies && !(table.rows[r].applies & bit) &&
            (!except || table.rows[r].applies != except))
            pen_json_bool(json, table.rows[r].name, false);
    if (also)
        pen_json_bool(json, also, false);
    pen_json_end(json);
}

/* A method with its parameters, as "Technique-<name>". */
static void write_method(struct pen_json *json, const struct pen_technique_info *info)
{
    static const char *const required[] = {"name", NULL};
    char key[64];
    snprintf(key, sizeof key, "Technique-%s", info->name);
    pen_json_object(json, key);
    pen_json_string(json, "type", "object");
    pen_json_string(json, "title", info->title);
    pen_json_string(json, "description", info->summary);
    write_strings(json, "required", required);
    pen_json_bool(json, "additionalProperties", false);
    pen_json_object(json, "properties");
    pen_json_object(json, "name");
    pen_json_string(json, "const", info->name);
    pen_json_end(json);
    open_object(json, "params", NULL);
    write_rows(json, info->params);
    close_object(json);
    close_object(json);
}

static void write_technique_name(struct pen_json *json, const struct pen_catalogue *catalogue)
{
    struct pen_request defaults;
    pen_request_default(&defaults, catalogue);
    pen_json_object(json, "TechniqueName");
    pen_json_string(json, "type", "string");
    pen_json_array(json, "enum");
    for (uint32_t i = 0; i < catalogue->count; i++)
        pen_json_string(json, NULL, catalogue->items[i]->name);
    pen_json_end(json);
    pen_json_string(json, "default", defaults.technique);
    pen_json_end(json);
}

static void write_technique_object(struct pen_json *json, const struct pen_catalogue *catalogue)
{
    char target[96];
    pen_json_object(json, "TechniqueObject");
    pen_json_string(
        json, "type", "object"); /* for validators that look at the discriminator alone */
    pen_json_array(json, "oneOf");
    for (uint32_t i = 0; i < catalogue->count; i++) {
        snprintf(target, sizeof target, SCHEMA "Technique-%s", catalogue->items[i]->name);
        write_ref(json, NULL, target);
    }
    pen_json_end(json);
    pen_json_object(json, "discriminator");
    pen_json_string(json, "propertyName", "name");
    pen_json_object(json, "mapping");
    for (uint32_t i = 0; i < catalogue->count; i++) {
        snprintf(target, sizeof target, SCHEMA "Technique-%s", catalogue->items[i]->name);
        pen_json_string(json, catalogue->items[i]->name, target);
    }
    pen_json_end(json);
    pen_json_end(json);
    pen_json_end(json);
    for (uint32_t i = 0; i < catalogue->count; i++)
        write_method(json, catalogue->items[i]);
}

static void write_technique(struct pen_json *json, const struct pen_catalogue *catalogue)
{
    (void)catalogue;
    pen_json_object(json, "Technique");
    pen_json_string(json, "description", "A method's name, or its name and parameters.");
    pen_json_array(json, "oneOf");
    write_ref(json, NULL, SCHEMA "TechniqueName");
    write_ref(json, NULL, SCHEMA "TechniqueObject");
    pen_json_end(json);
    pen_json_end(json);
}

static void write_camera(struct pen_json *json, const struct pen_catalogue *catalogue)
{
    (void)catalogue;
    const uint32_t orbit = PEN_CAMERA_BIT(PEN_CAMERA_ORBIT);
    const uint32_t look_at = PEN_CAMERA_BIT(PEN_CAMERA_LOOK_AT);
    static const char *const eye[] = {"eye", NULL};
    struct pen_param_table table = pen_camera_table();
    open_object(json, "Camera",
        "A point of view (eye), a camera of the scene (index) or an orbit around the centre of its "
        "bounds; without any of them the bounds are framed.");
    for (uint32_t r = 0; r < table.count; r++)
        if (table.rows[r].applies != orbit)
            pen_openapi_row(json, table.rows[r].name, &table.rows[r]);
    open_object(json, "orbit", NULL);
    for (uint32_t r = 0; r < table.count; r++)
        if (table.rows[r].applies == orbit)
            pen_openapi_row(json, table.rows[r].name, &table.rows[r]);
    close_object(json);
    pen_json_end(json);
    pen_json_object(json, "dependentRequired");
    for (uint32_t r = 0; r < table.count; r++)
        if (table.rows[r].applies == look_at && strcmp(table.rows[r].name, "eye"))
            write_strings(json, table.rows[r].name, eye);
    pen_json_end(json);
    pen_json_object(json, "dependentSchemas");
    pen_json_object(json, "index");
    forbid_rows(json, table, PEN_CAMERA_BIT(PEN_CAMERA_INDEX), orbit, "orbit");
    pen_json_end(json);
    pen_json_object(json, "orbit");
    forbid_rows(json, table, orbit, 0, NULL);
    pen_json_end(json);
    pen_json_end(json);
    pen_json_end(json);
}

static void write_texture(struct pen_json *json, const struct pen_catalogue *catalogue)
{
    (void)catalogue;
    open_object(json, "LightTexture", "What a rect light emits over its area; black cuts shapes.");
    pen_json_object(json, "image");
    pen_json_string(json, "$ref", SCHEMA "Id");
    pen_json_string(json, "description", "The id of an uploaded image.");
    pen_json_end(json);
    write_ref(json, "pattern", SCHEMA "LightPattern");
    pen_json_end(json);
    pen_json_uint(json, "minProperties", 1);
    pen_json_uint(json, "maxProperties", 1);
    pen_json_end(json);
}

static void write_light_pattern(struct pen_json *json, const struct pen_catalogue *catalogue)
{
    (void)catalogue;
    pen_json_object(json, "LightPattern");
    pen_json_string(json, "type", "string");
    write_strings(json, "enum", pen_pattern_names);
    pen_json_end(json);
}

static void write_light_type(struct pen_json *json, const struct pen_catalogue *catalogue)
{
    (void)catalogue;
    pen_json_object(json, "LightType");
    pen_json_string(json, "type", "string");
    write_strings(json, "enum", pen_light_type_names);
    pen_json_string(json, "default", pen_light_type_names[PEN_LIGHT_RECT]);
    pen_json_end(json);
}

static void write_light(struct pen_json *json, const struct pen_catalogue *catalogue)
{
    (void)catalogue;
    static const char *const type_key[] = {"type", NULL};
    struct pen_param_table table = pen_light_table();
    open_object(json, "Light", "A light; the rows that it takes depend on its type.");
    write_ref(json, "type", SCHEMA "LightType");
    write_rows(json, table);
    write_ref(json, "texture", SCHEMA "LightTexture");
    pen_json_end(json);
    write_both(json, "not", "power_w", "radiance");
    pen_json_array(json, "allOf");
    for (uint32_t type = 0; type < PEN_LIGHT_TYPES; type++) {
        pen_json_object(json, NULL);
        pen_json_object(json, "if");
        pen_json_object(json, "properties");
        pen_json_object(json, "type");
        pen_json_string(json, "const", pen_light_type_names[type]);
        pen_json_end(json);
        pen_json_end(json);
        if (type != PEN_LIGHT_RECT) /* the type when none is given */
            write_strings(json, "required", type_key);
        pen_json_end(json);
        pen_json_object(json, "then");
        forbid_rows(json, table, PEN_LIGHT_BIT(type), 0, type == PEN_LIGHT_RECT ? NULL : "texture");
        pen_json_end(json);
        pen_json_end(json);
    }
    pen_json_end(json);
    pen_json_end(json);
}

static void write_lights(struct pen_json *json, const struct pen_catalogue *catalogue)
{
    (void)catalogue;
    pen_json_object(json, "Lights");
    pen_json_string(json, "type", "array");
    pen_json_uint(json, "maxItems", PEN_MAX_LIGHTS);
    write_ref(json, "items", SCHEMA "Light");
    pen_json_string(json, "description",
        "Left out: the scene's own lights, else one that suits its bounds. Empty: ambient only.");
    pen_json_end(json);
}

static void write_request(struct pen_json *json, const struct pen_catalogue *catalogue)
{
    (void)catalogue;
    open_object(json, "RenderRequest", "Every key may be left out; {} gives a picture.");
    write_ref(json, "technique", SCHEMA "Technique");
    write_ref(json, "camera", SCHEMA "Camera");
    write_ref(json, "lights", SCHEMA "Lights");
    write_rows(json, pen_request_table());
    write_ref(json, "output", SCHEMA "Output");
    write_rows(json, pen_delivery_table());
    close_object(json);
}

static void write_output(struct pen_json *json, const struct pen_catalogue *catalogue)
{
    (void)catalogue;
    open_object(json, "Output", NULL);
    write_rows(json, pen_output_table());
    close_object(json);
}

static void write_compare(struct pen_json *json, const struct pen_catalogue *catalogue)
{
    (void)catalogue;
    open_object(
        json, "CompareRequest", "A render request with a list of methods; {} compares all.");
    pen_json_raw(json, "techniques",
        "{\"description\":\"all: every method with its defaults.\",\"default\":\"all\",\"oneOf\":[{"
        "\"const\":\"all\"},{\"type\":\"array\",\"minItems\":1,\"maxItems\":32,\"items\":{"
        "\"$ref\":\"" SCHEMA "Technique\"}}]}");
    pen_json_raw(json, "reference",
        "{\"description\":\"Left out: raytraced with 1024 samples.\",\"$ref\":\"" SCHEMA
        "Technique\"}");
    write_ref(json, "camera", SCHEMA "Camera");
    write_ref(json, "lights", SCHEMA "Lights");
    write_rows(json, pen_request_table());
    write_rows(json, pen_delivery_table());
    close_object(json);
}

static void write_sequence(struct pen_json *json, const struct pen_catalogue *catalogue)
{
    (void)catalogue;
    static const char *const required[] = {"scene", NULL};
    open_object(json, "SequenceRequest",
        "A render request for many views of a scene. Every frame is the image that a request for "
        "its view alone gives; of lights that move, exposure_ev and sky_level are measured with "
        "the "
        "first frame where they are left out. With animation, a frame is 1/fps s after the one "
        "before. deadline_ms, on_deadline, priority, progressive and session say nothing here.");
    write_ref(json, "scene", SCHEMA "Id");
    open_object(json, "sequence",
        "turntable, views and keyframes exclude each other; without "
        "any of them the camera stands still.");
    write_rows(json, pen_sequence_table());
    open_object(json, "turntable", "Around the centre of the bounds, in even steps.");
    write_rows(json, pen_turntable_table());
    close_object(json);
    pen_json_raw(json, "views",
        "{\"type\":\"array\",\"minItems\":1,\"maxItems\":10000,\"items\":{\"$ref\":\"" SCHEMA
        "Camera\"}}");
    pen_json_raw(json, "keyframes",
        "{\"type\":\"array\",\"minItems\":1,\"maxItems\":256,\"description\":\"In order. Cameras "
        "have an eye, or are in orbit; the lights are as many and of the same types in all. Before "
        "the first keyframe and after the last nothing moves.\",\"items\":{\"type\":\"object\","
        "\"required\":[\"frame\"],\"additionalProperties\":false,\"properties\":{\"frame\":{"
        "\"type\":\"integer\",\"minimum\":0,\"maximum\":9999},\"camera\":{\"$ref\":\"" SCHEMA
        "Camera\"},\"lights\":{\"$ref\":\"" SCHEMA "Lights\"}}}}");
    close_object(json);
    write_ref(json, "technique", SCHEMA "Technique");
    write_ref(json, "camera", SCHEMA "Camera");
    write_ref(json, "lights", SCHEMA "Lights");
    write_rows(json, pen_request_table());
    write_ref(json, "output", SCHEMA "Output");
    write_rows(json, pen_delivery_table());
    pen_json_end(json);
    write_strings(json, "required", required);
    pen_json_end(json);
}

static void write_stage_times(struct pen_json *json, const struct pen_catalogue *catalogue)
{
    (void)catalogue;
    pen_json_object(json, "StageTimes");
    pen_json_string(json, "type", "object");
    pen_json_string(json, "description", "Milliseconds per stage.");
    write_strings(json, "required", pen_stage_names);
    pen_json_object(json, "properties");
    for (uint32_t s = 0; s < PEN_STAGES; s++)
        pen_json_raw(json, pen_stage_names[s], "{\"type\":[\"number\",\"null\"],\"minimum\":0}");
    pen_json_end(json);
    pen_json_end(json);
}

/* The files of the written ones: a missing one does not assemble. */
#define DERIVED(name, writer)
#define WRITTEN(name)                                                                              \
    __asm__(".section .rodata\nschema_" #name ": .incbin \"" SCHEMAS_FOLDER "/" #name              \
            ".json\"\n.byte 0\n.previous");                                                        \
    extern const char schema_##name[];
#include "protocol/schemas.def"
#undef WRITTEN
#undef DERIVED

void pen_openapi_schemas(struct pen_json *json, const struct pen_catalogue *catalogue)
{
#define DERIVED(name, writer) writer(json, catalogue);
#define WRITTEN(name) pen_json_raw(json, #name, schema_##name);
#include "protocol/schemas.def"
}
