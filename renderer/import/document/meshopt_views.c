/* EXT_meshopt_compression and KHR_meshopt_compression: https://github.com/KhronosGroup/glTF,
 * extensions/2.0/Vendor and Khronos. The library asserts what the extensions demand of sizes, so all
 * of it is checked here first. */
#include "renderer/import/base/budget.h"
#include "renderer/import/document/document.h"
#include "renderer/import/document/meshopt.h"
#include "renderer/import/base/text.h"
#include <cjson/cJSON.h>
#include <meshoptimizer.h>
#include <stdio.h>
#include <string.h>

static uint32_t number(const cJSON *object, const char *key)
{
    const cJSON *value = cJSON_GetObjectItemCaseSensitive(object, key);
    return value ? (uint32_t)value->valuedouble : 0; /* the schema has checked it */
}

static bool is(const cJSON *object, const char *key, const char *text)
{
    const cJSON *value = cJSON_GetObjectItemCaseSensitive(object, key);
    return value && !strcmp(value->valuestring, text);
}

static bool unpack(struct imp_view *view, const cJSON *extension, struct imp_bytes packed,
    uint8_t *out, const char *pointer, struct pen_error *error)
{
    uint32_t count = number(extension, "count"), stride = number(extension, "byteStride");
    bool attributes = is(extension, "mode", "ATTRIBUTES");
    bool triangles = is(extension, "mode", "TRIANGLES");
    bool none =
        !cJSON_GetObjectItemCaseSensitive(extension, "filter") || is(extension, "filter", "NONE");
    bool octahedral = is(extension, "filter", "OCTAHEDRAL");
    bool quaternion = is(extension, "filter", "QUATERNION");
    bool exponential = is(extension, "filter", "EXPONENTIAL");
    bool color = is(extension, "filter", "COLOR");
    bool fits = attributes
                    ? stride % 4 == 0 && (!octahedral || stride == 4 || stride == 8) &&
                          (!quaternion || stride == 8) && (!color || stride == 4 || stride == 8)
                    : (stride == 2 || stride == 4) && none && (!triangles || count % 3 == 0);
    if ((!attributes && !triangles && !is(extension, "mode", "INDICES")) ||
        !(none || octahedral || quaternion || exponential || color) || !fits)
        return pen_fail(error, PEN_INVALID, pointer,
            "glTF %s: the mode, filter, count and byteStride of meshopt_compression do not fit "
            "together.",
            pointer);
    int failed;
    if (attributes)
        failed = !imp_meshopt_attributes(out, count, stride, packed.data, packed.bytes);
    else if (triangles)
        failed = meshopt_decodeIndexBuffer(out, count, stride, packed.data, packed.bytes);
    else
        failed = meshopt_decodeIndexSequence(out, count, stride, packed.data, packed.bytes);
    if (failed)
        return pen_fail(error, PEN_INVALID, pointer,
            "glTF %s: the data of meshopt_compression are damaged.", pointer);
    if (octahedral)
        meshopt_decodeFilterOct(out, count, stride);
    else if (quaternion)
        meshopt_decodeFilterQuat(out, count, stride);
    else if (exponential)
        meshopt_decodeFilterExp(out, count, stride);
    else if (color)
        imp_meshopt_colors(out, count, stride);
    *view = (struct imp_view){out, (size_t)count * stride, attributes ? stride : 0};
    return true;
}

const cJSON *imp_meshopt_of(const cJSON *view)
{
    const cJSON *extensions = cJSON_GetObjectItemCaseSensitive(view, "extensions");
    const cJSON *newer = cJSON_GetObjectItemCaseSensitive(extensions, "KHR_meshopt_compression");
    return newer ? newer : cJSON_GetObjectItemCaseSensitive(extensions, "EXT_meshopt_compression");
}

bool imp_document_unpack_views(struct imp_document *document, struct pen_error *error)
{
    uint64_t total = 0;
    uint32_t i = 0;
    const cJSON *item;
    cJSON_ArrayForEach(item, cJSON_GetObjectItemCaseSensitive(document->root, "bufferViews"))
    {
        struct imp_view *view = &document->views[i];
        const cJSON *extension = imp_meshopt_of(item);
        char pointer[64];
        snprintf(pointer, sizeof pointer, "/bufferViews/%u", i++);
        if (!extension)
            continue;
        struct imp_bytes buffer = document->buffers[number(extension, "buffer")];
        uint64_t offset = number(extension, "byteOffset"), bytes = number(extension, "byteLength");
        uint64_t unpacked = (uint64_t)number(extension, "count") * number(extension, "byteStride");
        if (!buffer.data || offset + bytes > buffer.bytes)
            return pen_fail(error, PEN_INVALID, pointer,
                "glTF %s: the compressed data lie outside their buffer.", pointer);
        if (unpacked != number(item, "byteLength"))
            return pen_fail(error, PEN_INVALID, pointer,
                "glTF %s: byteLength is not count times byteStride.", pointer);
        total += unpacked;
        if (total > IMP_MAX_MESHOPT_BYTES)
            return pen_fail(error, PEN_TOO_BIG, pointer,
                "The glTF's compressed geometry unpacks to more than %llu bytes.",
                IMP_MAX_MESHOPT_BYTES);
        struct imp_bytes packed = {buffer.data + offset, (size_t)bytes};
        uint8_t *out = imp_document_alloc(document, (size_t)unpacked);
        if (!unpack(view, extension, packed, out, pointer, error))
            return false;
    }
    return true;
}
