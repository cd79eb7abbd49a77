/* KHR_draco_mesh_compression: https://github.com/KhronosGroup/glTF, extensions/2.0/Khronos. Each
 * compressed primitive becomes an ordinary one: what is unpacked is new buffer views, and new
 * accessors in the document point to them. */
#include "protocol/memory.h"
#include "renderer/import/base/budget.h"
#include "renderer/import/document/document.h"
#include "renderer/import/draco/draco_shim.h"
#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define UNSIGNED_INT 5125

struct unpacking {
    struct imp_document *document;
    cJSON *accessors, *views;
    const cJSON **old; /* the accessors that were there, as an array */
    uint32_t accessor_count;
    size_t view_capacity;
    uint64_t points, indices, bytes; /* so far */
};

static const cJSON *member(const cJSON *object, const char *key)
{
    return cJSON_GetObjectItemCaseSensitive(object, key);
}

static uint32_t number(const cJSON *object, const char *key)
{
    const cJSON *value = member(object, key);
    return value ? (uint32_t)value->valuedouble : 0; /* the schema has checked it */
}

static uint32_t component_bytes(uint32_t component)
{
    return component < 5122 ? 1 : component < 5124 ? 2 : 4;
}

static uint32_t components_of(const cJSON *accessor)
{
    static const char *const types[] = {"SCALAR", "VEC2", "VEC3", "VEC4"};
    for (uint32_t i = 0; i < 4; i++)
        if (!strcmp(member(accessor, "type")->valuestring, types[i]))
            return i + 1;
    return 0;
}

/* Memory of a new buffer view, and a new accessor over all of it. */
static uint8_t *add_accessor(struct unpacking *u, cJSON *accessor, size_t bytes)
{
    struct imp_document *document = u->document;
    uint8_t *data = imp_document_alloc(document, bytes);
    document->views = pen_grow(
        document->views, &u->view_capacity, document->view_count + 1, sizeof *document->views);
    document->views[document->view_count] = (struct imp_view){data, bytes, 0};
    cJSON *view = cJSON_CreateObject();
    cJSON_AddNumberToObject(view, "buffer", 0);
    cJSON_AddNumberToObject(view, "byteLength", (double)bytes);
    cJSON_AddItemToArray(u->views, view);
    cJSON_AddNumberToObject(accessor, "bufferView", document->view_count++);
    cJSON_AddItemToArray(u->accessors, accessor);
    u->accessor_count++;
    return data;
}

static cJSON *make_accessor(uint32_t component, const char *type, bool normalized, uint32_t count)
{
    cJSON *accessor = cJSON_CreateObject();
    cJSON_AddNumberToObject(accessor, "componentType", component);
    cJSON_AddStringToObject(accessor, "type", type);
    cJSON_AddBoolToObject(accessor, "normalized", normalized);
    cJSON_AddNumberToObject(accessor, "count", count);
    return accessor;
}

static bool add_attributes(struct unpacking *u, const struct draco_mesh *mesh, cJSON *primitive,
    const cJSON *extension, const char *pointer, struct pen_error *error)
{
    uint32_t points = draco_mesh_points(mesh);
    for (cJSON *at = member(primitive, "attributes")->child; at; at = at->next) {
        const cJSON *id = member(member(extension, "attributes"), at->string);
        if (!id)
            continue; /* not compressed */
        const cJSON *old = u->old[(size_t)at->valuedouble];
        uint32_t component = number(old, "componentType"), components = components_of(old);
        size_t bytes = (size_t)points * components * component_bytes(component);
        u->bytes += bytes;
        if (u->bytes > IMP_MAX_DRACO_BYTES)
            return pen_fail(error, PEN_TOO_BIG, pointer,
                "The glTF's compressed geometry unpacks to more than %llu bytes.",
                IMP_MAX_DRACO_BYTES);
        cJSON *accessor = make_accessor(component, member(old, "type")->valuestring,
            cJSON_IsTrue(member(old, "normalized")), points);
        uint32_t number = u->accessor_count;
        uint8_t *data = add_accessor(u, accessor, bytes);
        if (!components ||
            !draco_mesh_attribute(mesh, (uint32_t)id->valuedouble, component, components, data))
            return pen_fail(error, PEN_INVALID, pointer,
                "glTF %s: the Draco data have no %.40s of the accessor's type.", pointer,
                at->string);
        cJSON_SetNumberValue(at, number);
    }
    return true;
}

static bool unpack(struct unpacking *u, cJSON *primitive, const cJSON *extension,
    const char *pointer, struct pen_error *error)
{
    const struct imp_view *view = &u->document->views[number(extension, "bufferView")];
    struct pen_error why = {0};
    struct draco_mesh *mesh = draco_mesh_decode(view->data, view->bytes, &why);
    if (!mesh)
        return pen_fail(
            error, (enum pen_code)why.code, pointer, "glTF %s: %s.", pointer, why.message);
    uint32_t points = draco_mesh_points(mesh), faces = draco_mesh_faces(mesh);
    u->points += points;
    u->indices += 3 * (uint64_t)faces;
    bool done = false;
    if (u->points > IMP_MAX_VERTICES || u->indices > IMP_MAX_INDICES) {
        pen_fail(error, PEN_TOO_BIG, pointer,
            "The scene has more than %llu vertices or %llu triangles.", IMP_MAX_VERTICES,
            IMP_MAX_INDICES / 3);
        goto fail;
    }
    if (!add_attributes(u, mesh, primitive, extension, pointer, error))
        goto fail;
    cJSON_DeleteItemFromObjectCaseSensitive(primitive, "indices");
    cJSON_DeleteItemFromObjectCaseSensitive(primitive, "mode"); /* strips come as triangles */
    cJSON_AddNumberToObject(primitive, "indices", u->accessor_count);
    uint8_t *indices = add_accessor(
        u, make_accessor(UNSIGNED_INT, "SCALAR", false, 3 * faces), 12 * (size_t)faces);
    draco_mesh_indices(mesh, (uint32_t *)indices);
    done = true;
fail:
    draco_mesh_free(mesh);
    return done;
}

static bool unpack_meshes(struct unpacking *u, struct pen_error *error)
{
    uint32_t m = 0;
    const cJSON *mesh;
    cJSON_ArrayForEach(mesh, member(u->document->root, "meshes"))
    {
        uint32_t p = 0;
        cJSON *primitive;
        cJSON_ArrayForEach(primitive, member(mesh, "primitives"))
        {
            const cJSON *extension =
                member(member(primitive, "extensions"), "KHR_draco_mesh_compression");
            char pointer[96];
            snprintf(pointer, sizeof pointer, "/meshes/%u/primitives/%u", m, p++);
            if (extension && !unpack(u, primitive, extension, pointer, error))
                return false;
        }
        m++;
    }
    return true;
}

bool imp_document_unpack_draco(struct imp_document *document, struct pen_error *error)
{
    struct unpacking u = {.document = document,
        .accessors = cJSON_GetObjectItemCaseSensitive(document->root, "accessors"),
        .views = cJSON_GetObjectItemCaseSensitive(document->root, "bufferViews"),
        .view_capacity = document->view_count};
    const cJSON *item;
    u.old = pen_alloc_zero((size_t)cJSON_GetArraySize(u.accessors), sizeof *u.old);
    cJSON_ArrayForEach(item, u.accessors)
    {
        u.old[u.accessor_count++] = item;
    }
    bool done = unpack_meshes(&u, error);
    free(u.old);
    return done;
}
