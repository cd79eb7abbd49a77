#include "renderer/blob/builder.h"
#include "renderer/import/document/document.h"
#include "renderer/import/base/text.h"
#include <cjson/cJSON.h>
#include <string.h>

/* What is known, and what of it is missing in the picture: "" nothing, else the rest of a sentence
 * that becomes a warning. All others are refused when they are required. */
static const struct {
    const char *name, *missing;
} known[] = {
    {"EXT_lights_area", ""},
    {"EXT_mesh_gpu_instancing", ""},
    {"EXT_mesh_manifold", ""},
    {"EXT_meshopt_compression", ""},
    {"EXT_texture_avif", "is not decoded: such textures are drawn by their fallbacks, or plain"},
    {"EXT_texture_webp", ""},
    {"KHR_animation_pointer", ""},
    {"KHR_draco_mesh_compression", ""},
    {"KHR_lights_punctual", ""},
    {"KHR_materials_anisotropy", "is drawn without its direction: highlights are round"},
    {"KHR_materials_clearcoat", "is drawn without its coat"},
    {"KHR_materials_diffuse_transmission", "is drawn without light from behind"},
    {"KHR_materials_dispersion", "is drawn without colours at edges"},
    {"KHR_materials_emissive_strength", ""},
    {"KHR_materials_ior", ""},
    {"KHR_materials_iridescence", "is drawn without its colours of thin films"},
    {"KHR_materials_pbrSpecularGlossiness", ""},
    {"KHR_materials_sheen", "is drawn without its sheen"},
    {"KHR_materials_specular", ""},
    {"KHR_materials_transmission", "is drawn opaque: nothing shines through"},
    {"KHR_materials_unlit", ""},
    {"KHR_materials_variants", ""},
    {"KHR_materials_volume", "is drawn without depth: nothing is absorbed or bent inside"},
    {"KHR_mesh_quantization", ""},
    {"KHR_meshopt_compression", ""},
    {"KHR_node_hoverability", ""},
    {"KHR_node_selectability", ""},
    {"KHR_node_visibility", ""},
    {"KHR_texture_basisu",
        "is not decoded: such textures are drawn by their fallbacks, or plain; gltf-transform "
        "ktxdecompress makes PNG of them"},
    {"KHR_texture_transform", ""},
    {"KHR_xmp_json_ld", ""},
    {"MSFT_lod", "is drawn in its finest level only"},
    {"MSFT_texture_dds", "is not decoded: such textures are drawn by their fallbacks, or plain"},
};

/* The row's number, or -1. */
static int find(const char *name)
{
    for (size_t i = 0; i < sizeof known / sizeof *known; i++)
        if (!strcmp(known[i].name, name))
            return (int)i;
    return -1;
}

bool imp_extensions_check(const cJSON *root, struct psc_builder *builder, struct pen_error *error)
{
    const cJSON *item;
    cJSON_ArrayForEach(item, cJSON_GetObjectItemCaseSensitive(root, "extensionsRequired"))
    {
        if (find(item->valuestring) < 0)
            return pen_fail(error, PEN_INVALID, "/extensionsRequired",
                "The glTF requires the extension %s, which cannot be drawn here. Export it without "
                "this extension, or convert it, for example with gltf-transform or Blender.",
                imp_text(item->valuestring).s);
    }
    int warned = 0;
    cJSON_ArrayForEach(item, cJSON_GetObjectItemCaseSensitive(root, "extensionsUsed"))
    {
        const char *name = item->valuestring;
        int row = find(name);
        if (row >= 0 && !known[row].missing[0])
            continue;
        if (warned++ < 24)
            psc_builder_add_warning(builder, "The extension %s %s.", imp_text(name).s,
                row < 0 ? "is not supported and is ignored" : known[row].missing);
    }
    return true;
}
