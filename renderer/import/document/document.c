#include "renderer/import/document/document.h"
#include "protocol/memory.h"
#include "renderer/blob/builder.h"
#include "renderer/import/base/budget.h"
#include "renderer/import/document/schema.h"
#include "renderer/import/base/text.h"
#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define GLB_JSON 0x4e4f534au
#define GLB_BIN 0x004e4942u

#define BLANKS " \t\r\n"
#define MOST_WARNINGS 4 /* of a kind */

static uint32_t u32(const uint8_t *p)
{
    uint32_t x;
    memcpy(&x, p, 4);
    return x;
}

/* Finds the chunks of a .glb; bin stays empty when there is none. */
static bool split_glb(const uint8_t *data, size_t bytes, struct imp_bytes *json,
    struct imp_bytes *bin, struct pen_error *error)
{
    if (bytes < 20)
        return pen_fail(error, PEN_INVALID, "", "The glTF binary is truncated.");
    if (u32(data + 4) != 2) {
        char what[64];
        snprintf(what, sizeof what, "glTF binary of version %u", u32(data + 4));
        return imp_old_version(what, error);
    }
    size_t length = u32(data + 8);
    if (length > bytes || length < 20)
        return pen_fail(error, PEN_INVALID, "",
            "The glTF binary says that it has %zu bytes, but %zu were uploaded.", length, bytes);
    for (size_t at = 12, chunk = 0; at < length; chunk++) {
        if (length - at < 8)
            break; /* padding */
        size_t chunk_bytes = u32(data + at);
        uint32_t type = u32(data + at + 4);
        at += 8;
        if (chunk_bytes > length - at)
            return pen_fail(
                error, PEN_INVALID, "", "A chunk of the glTF binary is longer than the file.");
        if ((chunk == 0) != (type == GLB_JSON))
            return pen_fail(
                error, PEN_INVALID, "", "A glTF binary must start with one JSON chunk.");
        if (chunk == 0)
            *json = (struct imp_bytes){data + at, chunk_bytes};
        else if (type == GLB_BIN && !bin->data)
            *bin = (struct imp_bytes){data + at, chunk_bytes};
        at += chunk_bytes;
    }
    return true;
}

/* What people write into JSON by hand and other parsers let through, at a place or "". */
static const char *why_not_json(const char *at, const char *end)
{
    static const char *const words[] = {
        "NaN", "nan", "-nan", "Infinity", "-Infinity", "inf", "-inf"};
    while (at < end && strchr(BLANKS, *at))
        at++;
    size_t left = (size_t)(end - at);
    if (left > 1 && at[0] == '/' && (at[1] == '/' || at[1] == '*'))
        return ": JSON has no comments; take them out";
    if (left && (*at == '}' || *at == ']'))
        return ": in JSON no comma stands before a closing bracket";
    if (left && *at == '\'')
        return ": JSON's strings stand in double quotes";
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        if (left > strlen(words[i]) && !memcmp(at, words[i], strlen(words[i])))
            return ": JSON's numbers are finite";
    return "";
}

/* The parser says where it stopped, which may be one byte on. */
static const char *why_no_json(const char *text, const char *at, const char *end)
{
    const char *why = why_not_json(at, end);
    return *why || at == text ? why : why_not_json(at - 1, end);
}

static bool parse(struct imp_document *document, struct imp_bytes json, struct psc_builder *builder,
    struct pen_error *error)
{
    const char *text = (const char *)json.data, *end = NULL;
    while (json.bytes && !json.data[json.bytes - 1])
        json.bytes--; /* some writers pad with zeros */
    if (json.bytes > IMP_MAX_JSON_BYTES)
        return pen_fail(
            error, PEN_TOO_BIG, "", "The glTF's JSON has more than %u bytes.", IMP_MAX_JSON_BYTES);
    if (!imp_json_scan(text, json.bytes, error))
        return false;
    document->root = cJSON_ParseWithLengthOpts(text, json.bytes, &end, 0);
    if (!document->root)
        return pen_fail(error, PEN_INVALID, "",
            "The glTF's JSON cannot be parsed, near byte %zu%s.", end ? (size_t)(end - text) : 0,
            end ? why_no_json(text, end, text + json.bytes) : "");
    for (; end < text + json.bytes; end++)
        if (!strchr(BLANKS, *end))
            return pen_fail(error, PEN_INVALID, "", "The glTF's JSON is followed by something.");
    return imp_repair_version(document->root, builder, error) &&
           imp_schema_check(document->root, builder, error);
}

/* The bytes behind a uri: a data URI, decoded in place, or an uploaded file. */
static bool fetch(cJSON *uri, struct imp_files *files, const char *name, const char *pointer,
    const char **mime, struct imp_bytes *found, struct pen_error *error)
{
    if (!imp_is_data_uri(uri->valuestring))
        return imp_files_resolve(files, name, uri->valuestring, pointer, found, error);
    if (imp_data_uri_decode(uri->valuestring, mime, found))
        return true;
    return pen_fail(error, PEN_INVALID, pointer, "glTF %s: the data URI is damaged.", pointer);
}

static bool open_buffers(struct imp_document *document, struct imp_bytes bin,
    struct imp_files *files, const char *name, struct psc_builder *builder, struct pen_error *error)
{
    const cJSON *items = cJSON_GetObjectItemCaseSensitive(document->root, "buffers"), *item;
    document->buffer_count = (uint32_t)cJSON_GetArraySize(items);
    document->buffers = pen_alloc_zero(document->buffer_count, sizeof *document->buffers);
    uint32_t i = 0, warned = 0;
    cJSON_ArrayForEach(item, items)
    {
        struct imp_bytes *buffer = &document->buffers[i];
        char pointer[64];
        snprintf(pointer, sizeof pointer, "/buffers/%u", i);
        cJSON *uri = cJSON_GetObjectItemCaseSensitive(item, "uri");
        const char *mime = "";
        if (uri && !fetch(uri, files, name, pointer, &mime, buffer, error))
            return false;
        if (!uri && i == 0)
            *buffer = bin;
        size_t told = (size_t)cJSON_GetObjectItemCaseSensitive(item, "byteLength")->valuedouble;
        if (buffer->data && told > buffer->bytes && warned++ < MOST_WARNINGS)
            psc_builder_add_warning(builder,
                "Buffer %u has %zu bytes, %zu less than the glTF says.", i, buffer->bytes,
                told - buffer->bytes);
        if (buffer->data && told < buffer->bytes)
            buffer->bytes = told;
        i++;
    }
    return true;
}

static bool open_views(
    struct imp_document *document, struct psc_builder *builder, struct pen_error *error)
{
    const cJSON *items = cJSON_GetObjectItemCaseSensitive(document->root, "bufferViews"), *item;
    document->view_count = (uint32_t)cJSON_GetArraySize(items);
    document->views = pen_alloc_zero(document->view_count, sizeof *document->views);
    uint32_t i = 0, warned = 0;
    imp_repair_views(document->root, builder);
    cJSON_ArrayForEach(item, items)
    {
        struct imp_view *view = &document->views[i];
        char pointer[64];
        snprintf(pointer, sizeof pointer, "/bufferViews/%u", i++);
        if (imp_meshopt_of(item))
            continue;
        const cJSON *offset = cJSON_GetObjectItemCaseSensitive(item, "byteOffset");
        const cJSON *stride = cJSON_GetObjectItemCaseSensitive(item, "byteStride");
        size_t first = offset ? (size_t)offset->valuedouble : 0;
        size_t bytes = (size_t)cJSON_GetObjectItemCaseSensitive(item, "byteLength")->valuedouble;
        struct imp_bytes buffer =
            document
                ->buffers[(size_t)cJSON_GetObjectItemCaseSensitive(item, "buffer")->valuedouble];
        if (!buffer.data && bytes)
            return pen_fail(error, PEN_INVALID, pointer,
                "glTF %s: its buffer has neither a uri nor a binary chunk.", pointer);
        if (first > buffer.bytes)
            return pen_fail(error, PEN_INVALID, pointer,
                "glTF %s: it lies beyond its buffer of %zu bytes.", pointer, buffer.bytes);
        /* What is used of it may be there all the same: its accessors know. */
        if (bytes > buffer.bytes - first && warned++ < MOST_WARNINGS)
            psc_builder_add_warning(builder,
                "BufferView %u reaches beyond its buffer of %zu bytes.", i - 1, buffer.bytes);
        bytes = bytes < buffer.bytes - first ? bytes : buffer.bytes - first;
        static const uint8_t nothing;
        *view = (struct imp_view){buffer.data ? buffer.data + first : &nothing, bytes,
            stride ? (uint32_t)stride->valuedouble : 0};
    }
    return imp_document_unpack_views(document, error);
}

static bool open_images(struct imp_document *document, struct imp_files *files, const char *name,
    struct pen_error *error)
{
    const cJSON *items = cJSON_GetObjectItemCaseSensitive(document->root, "images"), *item;
    document->image_count = (uint32_t)cJSON_GetArraySize(items);
    document->images = pen_alloc_zero(document->image_count, sizeof *document->images);
    uint32_t i = 0;
    cJSON_ArrayForEach(item, items)
    {
        struct imp_image *image = &document->images[i];
        char pointer[64];
        snprintf(pointer, sizeof pointer, "/images/%u", i++);
        const char *mime = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(item, "mimeType"));
        image->mime = mime ? mime : "";
        cJSON *uri = cJSON_GetObjectItemCaseSensitive(item, "uri");
        const cJSON *view = cJSON_GetObjectItemCaseSensitive(item, "bufferView");
        if (uri && view)
            return pen_fail(
                error, PEN_INVALID, pointer, "glTF %s: it has a uri and a bufferView.", pointer);
        if (uri && !fetch(uri, files, name, pointer, &image->mime, &image->data, error))
            return false;
        if (view) {
            const struct imp_view *v = &document->views[(size_t)view->valuedouble];
            image->data = (struct imp_bytes){v->data, v->bytes};
        }
    }
    return true;
}

/* Leaves document->root with what the buffers and images point into and what moves, and the rest as
 * text. */
static void render_rest(struct imp_document *document)
{
    cJSON *kept = cJSON_CreateObject();
    const char *const resolved[] = {"buffers", "images", "animations", "skins"};
    for (size_t i = 0; i < sizeof resolved / sizeof *resolved; i++) {
        cJSON *item = cJSON_DetachItemFromObjectCaseSensitive(document->root, resolved[i]);
        if (item)
            cJSON_AddItemToObject(kept, resolved[i], item);
    }
    /* The views are read; tinygltf only has to find that they exist, and is strict about them. */
    cJSON *item;
    cJSON_ArrayForEach(item, cJSON_GetObjectItemCaseSensitive(document->root, "bufferViews"))
    {
        cJSON_DeleteItemFromObjectCaseSensitive(item, "byteStride");
        cJSON_SetNumberValue(cJSON_GetObjectItemCaseSensitive(item, "byteLength"), 1);
    }
    document->text = cJSON_PrintUnformatted(document->root);
    if (!kept || !document->text)
        abort();
    document->text_bytes = strlen(document->text);
    cJSON_Delete(document->root);
    document->root = kept;
}

bool imp_document_open(struct imp_document *document, const uint8_t *data, size_t bytes,
    struct imp_files *files, const char *name, struct psc_builder *builder, struct pen_error *error)
{
    memset(document, 0, sizeof *document);
    struct imp_bytes json = {data, bytes}, bin = {NULL, 0};
    if (bytes >= 4 && !memcmp(data, "glTF", 4) && !split_glb(data, bytes, &json, &bin, error))
        return false;
    if (!parse(document, json, builder, error) ||
        !imp_extensions_check(document->root, builder, error) ||
        !open_buffers(document, bin, files, name, builder, error) ||
        !open_views(document, builder, error) || !imp_document_unpack_draco(document, error) ||
        !open_images(document, files, name, error))
        goto fail;
    imp_repair_indices(document, builder);
    render_rest(document);
    return true;
fail:
    imp_document_finish(document);
    return false;
}

void imp_document_finish(struct imp_document *document)
{
    cJSON_Delete(document->root);
    free(document->buffers);
    free(document->views);
    free(document->images);
    cJSON_free(document->text);
    for (uint32_t i = 0; i < document->owned_count; i++)
        free(document->owned[i]);
    free(document->owned);
    memset(document, 0, sizeof *document);
}
