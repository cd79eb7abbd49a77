#include "renderer/import/document/schema.h"
#include "renderer/blob/builder.h"
#include "renderer/import/document/schema_table.h"
#include "renderer/import/base/text.h"
#include <cjson/cJSON.h>
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* Where the walk is: one per level, on the stack of the function that went there. */
struct step {
    const struct step *up;
    const char *key; /* NULL: an array, at `index` */
    uint32_t index;
};

struct walk {
    double counts[SCHEMA_ARRAYS]; /* length of each array that an index can point into */
    const struct step *at;
    struct psc_builder *builder;
    uint32_t warned;
    struct pen_error *error;
};

#define MOST_WARNINGS 8

static size_t write_pointer(const struct step *step, char pointer[128])
{
    size_t length = step->up ? write_pointer(step->up, pointer) : 0;
    if (step->key)
        length += (size_t)snprintf(pointer + length, 128 - length, "/%s", imp_text(step->key).s);
    else
        length += (size_t)snprintf(pointer + length, 128 - length, "/%u", step->index);
    return length < 128 ? length : 127;
}

static bool bad(struct walk *walk, const char *what)
{
    char pointer[128] = "";
    if (walk->at)
        write_pointer(walk->at, pointer);
    return pen_fail(walk->error, PEN_INVALID, pointer, "glTF %s: %s.", pointer, what);
}

static bool check_object(struct walk *walk, cJSON *object, const struct schema *schema);

static bool check_number(struct walk *walk, const cJSON *value, const struct field *field)
{
    double x = value->valuedouble;
    if (!cJSON_IsNumber(value) || !(fabs(x) <= FLT_MAX))
        return bad(walk, "must be a finite number");
    bool integer = field->kind != NUMBER && field->kind != NUMBERS;
    if (integer && (x != floor(x) || x < 0 || x > INT32_MAX))
        return bad(walk, "must be an integer from 0 to 2^31 - 1");
    bool index = field->kind == INDEX || field->kind == INDICES || field->kind == INDEX_MAP ||
                 field->kind == INDEX_MAPS;
    if (index && x >= walk->counts[field->into])
        return bad(walk, "refers to an item that does not exist");
    if (field->kind == UINT && (x < field->min || (field->max && x > field->max)))
        return bad(walk, "is out of range");
    return true;
}

static bool check_members(struct walk *walk, cJSON *value, const struct field *field, bool named);

static bool check_member(struct walk *walk, cJSON *item, const struct field *field, bool named)
{
    if (field->kind == INDEX_MAPS && !named)
        return cJSON_IsObject(item) ? check_members(walk, item, field, true)
                                    : bad(walk, "must be an object");
    if (field->kind == OBJECTS)
        return check_object(walk, item, field->schema);
    if (field->kind == STRINGS)
        return cJSON_IsString(item) || bad(walk, "must be a string");
    return check_number(walk, item, field);
}

/* Every member of an array or object. */
static bool check_members(struct walk *walk, cJSON *value, const struct field *field, bool named)
{
    uint32_t count = 0;
    for (cJSON *item = value->child; item; item = item->next, count++) {
        struct step step = {walk->at, named ? item->string : NULL, count};
        walk->at = &step;
        bool fine = check_member(walk, item, field, named);
        walk->at = step.up;
        if (!fine)
            return false;
    }
    if (field->kind == NUMBERS && field->max && count != field->max)
        return bad(walk, "has the wrong number of components");
    return true;
}

static bool check_value(struct walk *walk, cJSON *value, const struct field *field)
{
    switch (field->kind) {
    case INDEX:
    case UINT:
    case NUMBER:
        return check_number(walk, value, field);
    case NUMBERS:
    case INDICES:
    case OBJECTS:
    case STRINGS:
    case INDEX_MAPS:
        if (!cJSON_IsArray(value))
            return bad(walk, "must be an array");
        return check_members(walk, value, field, false);
    case INDEX_MAP:
    case UINT_MAP:
        if (!cJSON_IsObject(value))
            return bad(walk, "must be an object");
        return check_members(walk, value, field, true);
    case ANYTHING:
        return true;
    case OBJECT:
        return check_object(walk, value, field->schema);
    case STRING:
        return cJSON_IsString(value) || bad(walk, "must be a string");
    case BOOL:
        return cJSON_IsBool(value) || bad(walk, "must be true or false");
    }
    return false;
}

/* True when the member can only mean that there is none: it is then left out. */
static bool is_nothing(struct walk *walk, const cJSON *value, const struct field *field)
{
    double x = cJSON_IsNumber(value) ? value->valuedouble : 0;
    bool none = field->kind == INDEX && !field->required && x == -1;
    bool strange =
        field->dispensable && cJSON_IsNumber(value) && !(x >= field->min && x <= field->max);
    char pointer[128];
    if ((none || strange) && walk->warned++ < MOST_WARNINGS) {
        write_pointer(walk->at, pointer);
        psc_builder_add_warning(walk->builder, "glTF %s: %.9g %s.", pointer, x,
            none ? "is taken for none" : "is no mode of a sampler and is passed over");
    }
    return none || strange || cJSON_IsNull(value);
}

static bool check_object(struct walk *walk, cJSON *object, const struct schema *schema)
{
    if (!cJSON_IsObject(object))
        return bad(walk, "must be an object");
    uint32_t seen = 0;
    for (cJSON *item = object->child, *next; item; item = next) {
        next = item->next;
        uint32_t i = 0;
        while (i < schema->count && strcmp(schema->fields[i].key, item->string))
            i++;
        if (i == schema->count) {
            cJSON_Delete(cJSON_DetachItemViaPointer(object, item));
            continue;
        }
        const struct field *field = &schema->fields[i];
        struct step step = {walk->at, field->key, 0};
        walk->at = &step;
        /* Two parsers may prefer different ones, and then one of them was never checked. */
        bool nothing = is_nothing(walk, item, field);
        bool fine = nothing         ? true
                    : seen >> i & 1 ? bad(walk, "stands there twice")
                                    : check_value(walk, item, field);
        seen |= nothing ? 0 : 1u << i;
        walk->at = step.up;
        if (!fine)
            return false;
        if (nothing)
            cJSON_Delete(cJSON_DetachItemViaPointer(object, item));
    }
    for (uint32_t i = 0; i < schema->count; i++)
        if (schema->fields[i].required && !(seen >> i & 1)) {
            struct step step = {walk->at, schema->fields[i].key, 0};
            walk->at = &step;
            bad(walk, "is required");
            walk->at = step.up;
            return false;
        }
    return true;
}

static const cJSON *descend(const cJSON *root, const char *a, const char *b)
{
    return cJSON_GetObjectItemCaseSensitive(cJSON_GetObjectItemCaseSensitive(root, a), b);
}

bool imp_schema_check(cJSON *root, struct psc_builder *builder, struct pen_error *error)
{
    struct walk walk = {.builder = builder, .error = error};
    if (!cJSON_IsObject(root))
        return bad(&walk, "must be an object");
    const cJSON *extensions = cJSON_GetObjectItemCaseSensitive(root, "extensions");
    for (int i = 0; i < SCHEMA_ARRAYS; i++) {
        const struct schema_array *array = &schema_arrays[i];
        const cJSON *items = array->extension ? descend(extensions, array->extension, array->key)
                                              : cJSON_GetObjectItemCaseSensitive(root, array->key);
        int count = cJSON_IsArray(items) ? cJSON_GetArraySize(items) : 0;
        walk.counts[i] = count;
        if ((uint32_t)count > array->most)
            return pen_fail(error, PEN_TOO_BIG, "", "The glTF has %d %s; %u are allowed.", count,
                array->key, array->most);
    }
    return check_object(&walk, root, &schema_root);
}
