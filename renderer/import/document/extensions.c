#include "renderer/blob/builder.h"
#include "renderer/import/document/document.h"
#include "renderer/import/base/text.h"
#include <cjson/cJSON.h>
#include <fnmatch.h>
#include <string.h>

/* What is known, and what of it is missing in the picture: "" nothing, else the rest of a sentence
 * that becomes a warning. All others are refused when they are required. Names are patterns of
 * fnmatch, of which the first that fits counts: extensions of materials and lights leave the shape
 * alone, whoever made them, and much else says nothing of the picture. */
static const struct {
    const char *name, *missing;
} known[] = {
    {"AGI_*", ""},
    {"CESIUM_primitive_outline", "is drawn without its outlines"},
    {"EXT_instance_features", ""},
    {"EXT_lights_area", ""},
    {"EXT_mesh_features", ""},
    {"EXT_mesh_gpu_instancing", ""},
    {"EXT_mesh_manifold", ""},
    {"EXT_meshopt_compression", ""},
    {"EXT_structural_metadata", ""},
    {"EXT_texture_avif", "is not decoded: such textures are drawn by their fallbacks, or plain"},
    {"EXT_texture_webp", ""},
    {"FB_geometry_metadata", ""},
    {"FB_ngon_encoding", ""},
    {"GODOT_single_root", ""},
    {"KHR_animation_pointer", ""},
    {"KHR_audio*", ""},
    {"KHR_draco_mesh_compression", ""},
    {"KHR_gaussian_splatting*", "is drawn as plain points"},
    {"KHR_implicit_shapes", ""},
    {"KHR_interactivity", ""},
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
    {"KHR_materials_transmission",
        "is drawn as a film: what is seen through it is neither bent nor "
        "coloured, and where a texture says where, it is opaque"},
    {"KHR_materials_unlit", ""},
    {"KHR_materials_variants", ""},
    {"KHR_materials_volume", "is drawn without depth: nothing is absorbed or bent inside"},
    {"KHR_mesh_quantization", ""},
    {"KHR_meshopt_compression", ""},
    {"KHR_node_hoverability", ""},
    {"KHR_node_selectability", ""},
    {"KHR_node_visibility", ""},
    {"KHR_physics_*", ""},
    {"KHR_techniques_webgl", "is drawn without its shaders"},
    {"KHR_texture_basisu",
        "is not decoded: such textures are drawn by their fallbacks, or plain; gltf-transform "
        "ktxdecompress makes PNG of them"},
    {"KHR_texture_transform", ""},
    {"KHR_xmp*", ""},
    {"MSFT_lod", "is drawn in its finest level only"},
    {"MSFT_packing_*", ""},
    {"MSFT_texture_dds", "is not decoded: such textures are drawn by their fallbacks, or plain"},
    {"OMI_*", ""},
    {"VRM", ""},
    {"VRMC_*", ""},
    {"*_materials_*", "is not supported: such materials are drawn as if they were without it"},
    {"*_lights_*", "is not supported: its lights are missing"},
    {"*_texture_*", "is not supported: such textures are drawn by their fallbacks, or plain"},
};

/* The row's number, or -1. */
static int find(const char *name)
{
    for (size_t i = 0; i < sizeof known / sizeof *known; i++)
        if (!fnmatch(known[i].name, name, 0))
            return (int)i;
    return -1;
}

static bool lists(const cJSON *root, const char *list, const char *name)
{
    const cJSON *item;
    cJSON_ArrayForEach(item, cJSON_GetObjectItemCaseSensitive(root, list))
    {
        if (!strcmp(item->valuestring, name))
            return true;
    }
    return false;
}

#define MOST_WARNINGS 24

/* Warns of those in `list`, but for those in `beside`. */
static void warn_of(
    const cJSON *root, const char *list, const char *beside, struct psc_builder *builder)
{
    const cJSON *item;
    int warned = 0;
    cJSON_ArrayForEach(item, cJSON_GetObjectItemCaseSensitive(root, list))
    {
        const char *name = item->valuestring;
        int row = find(name);
        if (warned == MOST_WARNINGS || (row >= 0 && !known[row].missing[0]) ||
            (beside && lists(root, beside, name)))
            continue;
        warned++;
        psc_builder_add_warning(builder, "The extension %s %s.", imp_text(name).s,
            row < 0 ? "is not supported and is ignored" : known[row].missing);
    }
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
    warn_of(root, "extensionsUsed", NULL, builder);
    warn_of(root, "extensionsRequired", "extensionsUsed", builder); /* some list them only there */
    return true;
}
