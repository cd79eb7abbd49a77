/* What the specification forbids, but can only be meant in one way. */
#include "protocol/memory.h"
#include "renderer/blob/builder.h"
#include "renderer/import/base/text.h"
#include "renderer/import/document/document.h"
#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define CONVERT_OLD                                                                                \
    "A tool such as gltf-pipeline (gltf-pipeline -i old.gltf -o new.glb) converts files of 1.0."

enum { I8 = 5120, I16 = 5122, I32 = 5124 };

static cJSON *member(const cJSON *object, const char *key)
{
    return cJSON_GetObjectItemCaseSensitive(object, key);
}

bool imp_old_version(const char *what, struct pen_error *error)
{
    return pen_fail(error, PEN_INVALID, "/asset/version",
        "The file is %s; only glTF 2.0 can be read. " CONVERT_OLD, what);
}

bool imp_repair_version(cJSON *root, struct psc_builder *builder, struct pen_error *error)
{
    cJSON *asset = member(root, "asset"), *version = member(asset, "version");
    const char *least = cJSON_GetStringValue(member(asset, "minVersion"));
    /* 1.0 has objects where 2.0 has arrays, and need not tell its version. */
    if (!version &&
        (cJSON_IsObject(member(root, "meshes")) || cJSON_IsObject(member(root, "nodes"))))
        return imp_old_version("glTF 1.0", error);
    if (cJSON_IsNumber(version)) {
        char text[32];
        snprintf(text, sizeof text, "%g", version->valuedouble);
        cJSON_ReplaceItemInObjectCaseSensitive(asset, "version", cJSON_CreateString(text));
        psc_builder_add_warning(builder, "The glTF tells its version as a number, not as text.");
    }
    const char *told = cJSON_GetStringValue(member(asset, "version"));
    if (!told)
        return true; /* the schema will say that it is missing */
    bool fine = !strncmp(told, "2", 1) && (!told[1] || told[1] == '.');
    if (fine && (!least || !strcmp(least, "2.0")))
        return true;
    char what[128];
    snprintf(what, sizeof what, "glTF %s", imp_text(least ? least : told).s);
    return imp_old_version(what, error);
}

void imp_repair_views(const cJSON *root, struct psc_builder *builder)
{
    const cJSON *item;
    uint32_t i = 0, odd = UINT32_MAX, empty = UINT32_MAX;
    cJSON_ArrayForEach(item, member(root, "bufferViews"))
    {
        const cJSON *stride = member(item, "byteStride");
        uint32_t step = stride ? (uint32_t)stride->valuedouble : 4;
        if (odd == UINT32_MAX && (step % 4 || step > 252 || !step))
            odd = i;
        if (empty == UINT32_MAX && member(item, "byteLength")->valuedouble < 1)
            empty = i;
        i++;
    }
    if (odd != UINT32_MAX)
        psc_builder_add_warning(builder,
            "The byteStride of bufferView %u is not a multiple of 4 from 4 to 252, as glTF wants; "
            "it is used as it is.",
            odd);
    if (empty != UINT32_MAX)
        psc_builder_add_warning(builder, "BufferView %u is empty.", empty);
}

/* A view that stands for zeros: what an accessor without a view is made of. */
static uint32_t add_zeros(struct imp_document *document)
{
    cJSON *view = cJSON_CreateObject();
    cJSON_AddNumberToObject(view, "buffer", 0);
    cJSON_AddNumberToObject(view, "byteLength", 0);
    if (!member(document->root, "bufferViews"))
        cJSON_AddArrayToObject(document->root, "bufferViews");
    cJSON_AddItemToArray(member(document->root, "bufferViews"), view);
    struct imp_view *views =
        pen_alloc_zero((size_t)document->view_count + 1, sizeof *document->views);
    memcpy(views, document->views, document->view_count * sizeof *views);
    free(document->views);
    document->views = views;
    return document->view_count++;
}

void imp_repair_indices(struct imp_document *document, struct psc_builder *builder)
{
    const cJSON *items = member(document->root, "accessors"), *mesh, *primitive;
    cJSON **accessors = pen_alloc_zero((size_t)cJSON_GetArraySize(items), sizeof *accessors);
    uint32_t count = 0, zeros = UINT32_MAX;
    bool warned = false;
    for (cJSON *item = items ? items->child : NULL; item; item = item->next)
        accessors[count++] = item;
    cJSON_ArrayForEach(mesh, member(document->root, "meshes"))
    {
        cJSON_ArrayForEach(primitive, member(mesh, "primitives"))
        {
            const cJSON *number = member(primitive, "indices");
            if (!number)
                continue;
            cJSON *accessor = accessors[(size_t)number->valuedouble];
            cJSON *component = member(accessor, "componentType");
            int kind = (int)component->valuedouble;
            if (kind == I8 || kind == I16 || kind == I32) {
                cJSON_SetNumberValue(component, kind + 1);
                if (!warned)
                    psc_builder_add_warning(builder,
                        "Indices of signed integers are read as unsigned ones, as glTF wants.");
                warned = true;
            }
            if (!member(accessor, "bufferView")) { /* tinygltf insists on one, for indices only */
                zeros = zeros == UINT32_MAX ? add_zeros(document) : zeros;
                cJSON_AddNumberToObject(accessor, "bufferView", zeros);
            }
        }
    }
    free(accessors);
}
