#include "renderer/import/document/schema_table.h"
#include "renderer/import/base/budget.h"

/* clang-format off */
#define SCHEMA(name, ...)                                                                          \
    static const struct field name##_fields[] = {__VA_ARGS__};                                     \
    static const struct schema name = {name##_fields, sizeof name##_fields / sizeof(struct field)}
#define OBJ(key, of) {key, OBJECT, .schema = &of}
#define ARRAY(key, of) {key, OBJECTS, .schema = &of}

const struct schema_array schema_arrays[SCHEMA_ARRAYS] = {
    [IN_BUFFERS] = {"buffers", 65536},
    [IN_VIEWS] = {"bufferViews", IMP_MAX_ITEMS},
    [IN_ACCESSORS] = {"accessors", IMP_MAX_ITEMS},
    [IN_MESHES] = {"meshes", IMP_MAX_PRIMITIVES},
    [IN_NODES] = {"nodes", IMP_MAX_NODES},
    [IN_SCENES] = {"scenes", 4096},
    [IN_MATERIALS] = {"materials", IMP_MAX_MATERIALS},
    [IN_TEXTURES] = {"textures", IMP_MAX_MATERIALS},
    [IN_IMAGES] = {"images", IMP_MAX_IMAGES},
    [IN_SAMPLERS] = {"samplers", IMP_MAX_MATERIALS},
    [IN_CAMERAS] = {"cameras", IMP_MAX_MATERIALS},
    [IN_SKINS] = {"skins", IMP_MAX_MATERIALS},
    [IN_LIGHTS] = {"lights", IMP_MAX_MATERIALS, "KHR_lights_punctual"},
    [IN_AREA_LIGHTS] = {"lights", IMP_MAX_MATERIALS, "EXT_lights_area"},
    [IN_VARIANTS] = {"variants", IMP_MAX_VARIANTS, "KHR_materials_variants"},
};

SCHEMA(asset, {"version", STRING, .required = true}, {"minVersion", STRING});

SCHEMA(buffer, {"byteLength", UINT, .required = true}, {"uri", STRING});

SCHEMA(meshopt,
    {"buffer", INDEX, .required = true, .into = IN_BUFFERS},
    {"byteOffset", UINT},
    {"byteLength", UINT, .required = true, .min = 1},
    {"byteStride", UINT, .required = true, .min = 1, .max = 256},
    {"count", UINT, .required = true, .min = 1},
    {"mode", STRING, .required = true},
    {"filter", STRING});
SCHEMA(view_extensions,
    OBJ("EXT_meshopt_compression", meshopt),
    OBJ("KHR_meshopt_compression", meshopt));
SCHEMA(view,
    {"buffer", INDEX, .required = true, .into = IN_BUFFERS},
    {"byteOffset", UINT},
    {"byteLength", UINT, .required = true},
    {"byteStride", UINT},
    OBJ("extensions", view_extensions));

SCHEMA(sparse_indices,
    {"bufferView", INDEX, .required = true, .into = IN_VIEWS},
    {"byteOffset", UINT},
    {"componentType", UINT, .required = true, .min = 5121, .max = 5125});
SCHEMA(sparse_values,
    {"bufferView", INDEX, .required = true, .into = IN_VIEWS},
    {"byteOffset", UINT});
SCHEMA(sparse,
    {"count", UINT, .required = true},
    {"indices", OBJECT, .required = true, .schema = &sparse_indices},
    {"values", OBJECT, .required = true, .schema = &sparse_values});
SCHEMA(accessor,
    {"bufferView", INDEX, .into = IN_VIEWS},
    {"byteOffset", UINT},
    {"componentType", UINT, .required = true, .min = 5120, .max = 5126},
    {"normalized", BOOL},
    {"count", UINT, .required = true},
    {"type", STRING, .required = true},
    OBJ("sparse", sparse));

SCHEMA(draco,
    {"bufferView", INDEX, .required = true, .into = IN_VIEWS},
    {"attributes", UINT_MAP, .required = true});
SCHEMA(variant_mapping,
    {"material", INDEX, .required = true, .into = IN_MATERIALS},
    {"variants", INDICES, .required = true, .into = IN_VARIANTS});
SCHEMA(variant_mappings, ARRAY("mappings", variant_mapping));
SCHEMA(primitive_extensions,
    OBJ("KHR_draco_mesh_compression", draco),
    OBJ("KHR_materials_variants", variant_mappings));
SCHEMA(primitive,
    {"attributes", INDEX_MAP, .required = true, .into = IN_ACCESSORS},
    {"indices", INDEX, .into = IN_ACCESSORS},
    {"material", INDEX, .into = IN_MATERIALS},
    {"mode", UINT, .max = 6},
    {"targets", INDEX_MAPS, .into = IN_ACCESSORS},
    OBJ("extensions", primitive_extensions));
SCHEMA(mesh,
    {"primitives", OBJECTS, .required = true, .schema = &primitive},
    {"weights", NUMBERS});

SCHEMA(light_use, {"light", INDEX, .required = true, .into = IN_LIGHTS});
SCHEMA(area_light_use, {"light", INDEX, .required = true, .into = IN_AREA_LIGHTS});
SCHEMA(gpu_instancing, {"attributes", INDEX_MAP, .required = true, .into = IN_ACCESSORS});
SCHEMA(node_visibility, {"visible", BOOL});
SCHEMA(node_extensions,
    OBJ("KHR_node_visibility", node_visibility),
    OBJ("KHR_lights_punctual", light_use),
    OBJ("EXT_lights_area", area_light_use),
    OBJ("EXT_mesh_gpu_instancing", gpu_instancing));
SCHEMA(node,
    {"name", STRING},
    {"children", INDICES, .into = IN_NODES},
    {"mesh", INDEX, .into = IN_MESHES},
    {"camera", INDEX, .into = IN_CAMERAS},
    {"skin", INDEX, .into = IN_SKINS},
    {"matrix", NUMBERS, .max = 16},
    {"translation", NUMBERS, .max = 3},
    {"rotation", NUMBERS, .max = 4},
    {"scale", NUMBERS, .max = 3},
    {"weights", NUMBERS},
    OBJ("extensions", node_extensions));

SCHEMA(texture_transform,
    {"offset", NUMBERS, .max = 2},
    {"rotation", NUMBER},
    {"scale", NUMBERS, .max = 2},
    {"texCoord", UINT});
SCHEMA(texture_info_extensions, OBJ("KHR_texture_transform", texture_transform));
SCHEMA(texture_info,
    {"index", INDEX, .required = true, .into = IN_TEXTURES},
    {"texCoord", UINT},
    {"scale", NUMBER},
    {"strength", NUMBER},
    OBJ("extensions", texture_info_extensions));
SCHEMA(metallic_roughness,
    {"baseColorFactor", NUMBERS, .max = 4},
    OBJ("baseColorTexture", texture_info),
    {"metallicFactor", NUMBER},
    {"roughnessFactor", NUMBER},
    OBJ("metallicRoughnessTexture", texture_info));
SCHEMA(specular_glossiness,
    {"diffuseFactor", NUMBERS, .max = 4},
    OBJ("diffuseTexture", texture_info),
    {"specularFactor", NUMBERS, .max = 3},
    {"glossinessFactor", NUMBER},
    OBJ("specularGlossinessTexture", texture_info));
SCHEMA(emissive_strength, {"emissiveStrength", NUMBER});
SCHEMA(unlit, {"name", STRING}); /* empty; but C has no empty arrays */
SCHEMA(ior, {"ior", NUMBER});
SCHEMA(transmission, {"transmissionFactor", NUMBER}, OBJ("transmissionTexture", texture_info));
SCHEMA(specular, {"specularFactor", NUMBER}, {"specularColorFactor", NUMBERS, .max = 3});
SCHEMA(material_extensions,
    OBJ("KHR_materials_ior", ior),
    OBJ("KHR_materials_transmission", transmission),
    OBJ("KHR_materials_specular", specular),
    OBJ("KHR_materials_unlit", unlit),
    OBJ("KHR_materials_pbrSpecularGlossiness", specular_glossiness),
    OBJ("KHR_materials_emissive_strength", emissive_strength));
SCHEMA(material,
    OBJ("pbrMetallicRoughness", metallic_roughness),
    OBJ("normalTexture", texture_info),
    OBJ("occlusionTexture", texture_info),
    OBJ("emissiveTexture", texture_info),
    {"emissiveFactor", NUMBERS, .max = 3},
    {"alphaMode", STRING},
    {"alphaCutoff", NUMBER},
    {"doubleSided", BOOL},
    OBJ("extensions", material_extensions));

SCHEMA(texture_source, {"source", INDEX, .into = IN_IMAGES});
SCHEMA(texture_extensions,
    OBJ("EXT_texture_avif", texture_source),
    OBJ("EXT_texture_webp", texture_source),
    OBJ("KHR_texture_basisu", texture_source),
    OBJ("MSFT_texture_dds", texture_source));
SCHEMA(texture,
    {"sampler", INDEX, .into = IN_SAMPLERS},
    {"source", INDEX, .into = IN_IMAGES},
    OBJ("extensions", texture_extensions));
SCHEMA(image, {"uri", STRING}, {"mimeType", STRING}, {"bufferView", INDEX, .into = IN_VIEWS});
SCHEMA(sampler,
    {"magFilter", UINT, .dispensable = true, .min = 9728, .max = 9729},
    {"minFilter", UINT, .dispensable = true, .min = 9728, .max = 9987},
    {"wrapS", UINT, .dispensable = true, .min = 10497, .max = 33648},
    {"wrapT", UINT, .dispensable = true, .min = 10497, .max = 33648});

SCHEMA(perspective,
    {"yfov", NUMBER, .required = true},
    {"znear", NUMBER, .required = true},
    {"zfar", NUMBER},
    {"aspectRatio", NUMBER});
SCHEMA(orthographic,
    {"xmag", NUMBER, .required = true},
    {"ymag", NUMBER, .required = true},
    {"znear", NUMBER, .required = true},
    {"zfar", NUMBER, .required = true});
SCHEMA(camera,
    {"type", STRING, .required = true},
    {"name", STRING},
    OBJ("perspective", perspective),
    OBJ("orthographic", orthographic));

SCHEMA(scene, {"nodes", INDICES, .into = IN_NODES});

SCHEMA(spot, {"innerConeAngle", NUMBER}, {"outerConeAngle", NUMBER});
SCHEMA(light,
    {"type", STRING, .required = true},
    {"name", STRING},
    {"color", NUMBERS, .max = 3},
    {"intensity", NUMBER},
    {"range", NUMBER},
    OBJ("spot", spot));
SCHEMA(lights, ARRAY("lights", light));
SCHEMA(area_rect, {"aspect", NUMBER});
SCHEMA(area_light,
    {"type", STRING, .required = true},
    {"name", STRING},
    {"color", NUMBERS, .max = 3},
    {"intensity", NUMBER},
    {"size", NUMBER},
    OBJ("rect", area_rect));
SCHEMA(area_lights, ARRAY("lights", area_light));
SCHEMA(variant, {"name", STRING});
SCHEMA(variants, ARRAY("variants", variant));
SCHEMA(root_extensions,
    OBJ("KHR_lights_punctual", lights),
    OBJ("EXT_lights_area", area_lights),
    OBJ("KHR_materials_variants", variants));

SCHEMA(skin,
    {"inverseBindMatrices", INDEX, .into = IN_ACCESSORS},
    {"joints", INDICES, .required = true, .into = IN_NODES});
SCHEMA(animation_pointer, {"pointer", STRING, .required = true});
SCHEMA(channel_target_extensions, OBJ("KHR_animation_pointer", animation_pointer));
SCHEMA(channel_target,
    {"node", INDEX, .into = IN_NODES},
    {"path", STRING, .required = true},
    OBJ("extensions", channel_target_extensions));
SCHEMA(channel,
    {"sampler", UINT, .required = true},
    {"target", OBJECT, .required = true, .schema = &channel_target});
SCHEMA(animation_sampler,
    {"input", INDEX, .required = true, .into = IN_ACCESSORS},
    {"output", INDEX, .required = true, .into = IN_ACCESSORS},
    {"interpolation", STRING});
SCHEMA(animation,
    {"name", STRING},
    {"channels", OBJECTS, .required = true, .schema = &channel},
    {"samplers", OBJECTS, .required = true, .schema = &animation_sampler});

static const struct field root_fields[] = {
    {"asset", OBJECT, .required = true, .schema = &asset},
    {"extensionsUsed", STRINGS},
    {"extensionsRequired", STRINGS},
    ARRAY("buffers", buffer),
    ARRAY("bufferViews", view),
    ARRAY("accessors", accessor),
    ARRAY("meshes", mesh),
    ARRAY("nodes", node),
    ARRAY("scenes", scene),
    {"scene", INDEX, .into = IN_SCENES},
    ARRAY("materials", material),
    ARRAY("textures", texture),
    ARRAY("images", image),
    ARRAY("samplers", sampler),
    ARRAY("cameras", camera),
    ARRAY("skins", skin),
    ARRAY("animations", animation),
    OBJ("extensions", root_extensions),
};
const struct schema schema_root = {root_fields, sizeof root_fields / sizeof *root_fields};
/* clang-format on */
