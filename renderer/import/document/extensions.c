#include "renderer/blob/builder.h"
#include "renderer/import/document/document.h"
#include "renderer/import/base/text.h"
#include <cjson/cJSON.h>
#include <string.h>

static const char *const supported[] = {
    "EXT_lights_area",
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
};

/* Used without being required, these change nothing that we draw. */
static const char *const harmless[] = {
    "EXT_mesh_manifold",
    "KHR_animation_pointer",
    "KHR_draco_mesh_compression", /* the uncompressed accessors are used */
    "KHR_texture_basisu",         /* the fallback image is used */
    "KHR_xmp_json_ld",
};

static bool among(const char *const *names, size_t count, const char *name)
{
    for (size_t i = 0; i < count; i++)
        if (!strcmp(names[i], name))
            return true;
    return false;
}

#define AMONG(names, name) among(names, sizeof names / sizeof *names, name)

bool imp_extensions_check(const cJSON *root, struct psc_builder *builder, struct pen_error *error)
{
    const cJSON *item;
    cJSON_ArrayForEach(item, cJSON_GetObjectItemCaseSensitive(root, "extensionsRequired"))
    {
        if (!AMONG(supported, item->valuestring))
            return pen_fail(error, PEN_INVALID, "/extensionsRequired",
                "The glTF requires the extension %s, which is not supported.",
                imp_text(item->valuestring).s);
    }
    int warned = 0;
    cJSON_ArrayForEach(item, cJSON_GetObjectItemCaseSensitive(root, "extensionsUsed"))
    {
        const char *name = item->valuestring;
        if (!AMONG(supported, name) && !AMONG(harmless, name) && warned++ < 16)
            psc_builder_add_warning(
                builder, "The extension %s is not supported and is ignored.", imp_text(name).s);
    }
    return true;
}
