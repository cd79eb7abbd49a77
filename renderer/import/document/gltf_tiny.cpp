/* The only C++ of the importer: tinygltf's model copied into plain structs. Every exception stops
 * in gltf_tiny_parse. */
#include "renderer/import/document/gltf_tiny.h"
#include "renderer/import/base/budget.h"
#include "renderer/import/base/text.h"
#include <algorithm>
#include <cstring>
#include <deque>
#include <tiny_gltf.h>

namespace
{

struct Owner {
    std::vector<gltf_accessor> accessors;
    std::vector<gltf_primitive> primitives;
    std::vector<gltf_mesh> meshes;
    std::vector<gltf_mapping> mappings;
    std::vector<const char *> variants;
    std::vector<gltf_node> nodes;
    std::vector<int32_t> children, roots;
    std::vector<gltf_target> targets;
    std::vector<float> weights;
    std::vector<gltf_material> materials;
    std::vector<gltf_texture> textures;
    std::vector<gltf_sampler> samplers;
    std::vector<gltf_camera> cameras;
    std::vector<gltf_light> lights, area_lights;
    std::deque<std::string> names; /* a deque never moves what it holds */

    void keep(const std::vector<double> &from, uint32_t &first, uint32_t &count)
    {
        first = static_cast<uint32_t>(weights.size());
        count = static_cast<uint32_t>(from.size());
        for (double weight : from)
            weights.push_back(static_cast<float>(weight));
    }

    const char *keep(const std::string &name)
    {
        if (name.empty())
            return "";
        names.emplace_back(name.c_str()); /* up to an embedded zero */
        return names.back().c_str();
    }
};

const tinygltf::Value *find(const tinygltf::ExtensionMap &extensions, const char *name)
{
    auto it = extensions.find(name);
    return it != extensions.end() && it->second.IsObject() ? &it->second : nullptr;
}

double number(const tinygltf::Value &object, const char *key, double otherwise)
{
    if (!object.Has(key))
        return otherwise;
    const tinygltf::Value &value = object.Get(key);
    return value.IsNumber() ? value.GetNumberAsDouble() : otherwise;
}

int32_t integer(const tinygltf::Value &object, const char *key, int32_t otherwise)
{
    double x = number(object, key, otherwise);
    return x >= -1 && x <= INT32_MAX ? static_cast<int32_t>(x) : otherwise;
}

void numbers(const tinygltf::Value &object, const char *key, float *out, size_t count)
{
    if (!object.Has(key) || !object.Get(key).IsArray() || object.Get(key).ArrayLen() != count)
        return;
    for (size_t i = 0; i < count; i++) {
        const tinygltf::Value &value = object.Get(key).Get(i);
        if (value.IsNumber())
            out[i] = static_cast<float>(value.GetNumberAsDouble());
    }
}

template <typename Number> void numbers(const std::vector<double> &from, Number *out, size_t count)
{
    if (from.size() == count)
        for (size_t i = 0; i < count; i++)
            out[i] = static_cast<Number>(from[i]);
}

std::string string(const tinygltf::Value &object, const char *key)
{
    return object.Has(key) && object.Get(key).IsString() ? object.Get(key).Get<std::string>()
                                                         : std::string();
}

gltf_texture_info no_texture()
{
    return {-1, 0, {0, 0}, 0, {1, 1}};
}

void apply_transform(gltf_texture_info &info, const tinygltf::Value &transform)
{
    numbers(transform, "offset", info.offset, 2);
    numbers(transform, "scale", info.scale, 2);
    info.rotation = static_cast<float>(number(transform, "rotation", 0));
    info.uv_set =
        static_cast<uint32_t>(integer(transform, "texCoord", static_cast<int32_t>(info.uv_set)));
}

/* TextureInfo, NormalTextureInfo and OcclusionTextureInfo share these members. */
template <typename Info> gltf_texture_info texture_info(const Info &from)
{
    gltf_texture_info info = no_texture();
    info.texture = from.index;
    info.uv_set = static_cast<uint32_t>(from.texCoord);
    if (const tinygltf::Value *transform = find(from.extensions, "KHR_texture_transform"))
        apply_transform(info, *transform);
    return info;
}

gltf_texture_info texture_info(const tinygltf::Value &object, const char *key)
{
    gltf_texture_info info = no_texture();
    if (!object.Has(key) || !object.Get(key).IsObject())
        return info;
    const tinygltf::Value &from = object.Get(key);
    info.texture = integer(from, "index", -1);
    info.uv_set = static_cast<uint32_t>(integer(from, "texCoord", 0));
    if (from.Has("extensions") && from.Get("extensions").Has("KHR_texture_transform"))
        apply_transform(info, from.Get("extensions").Get("KHR_texture_transform"));
    return info;
}

gltf_accessor convert(const tinygltf::Accessor &from)
{
    gltf_accessor to = {};
    to.view = from.bufferView;
    to.component = static_cast<uint32_t>(from.componentType);
    bool matrix = from.type == TINYGLTF_TYPE_MAT2 || from.type == TINYGLTF_TYPE_MAT3 ||
                  from.type == TINYGLTF_TYPE_MAT4;
    int components = from.type == TINYGLTF_TYPE_MAT4 ? 16
                     : matrix                        ? 0
                              : tinygltf::GetNumComponentsInType(static_cast<uint32_t>(from.type));
    to.components = components > 0 ? static_cast<uint32_t>(components) : 0;
    to.normalized = from.normalized;
    to.offset = from.byteOffset;
    to.count = from.count;
    to.sparse = from.sparse.isSparse;
    if (to.sparse) {
        to.sparse_count = static_cast<uint64_t>(from.sparse.count);
        to.sparse_index_view = from.sparse.indices.bufferView;
        to.sparse_index_offset = static_cast<uint64_t>(from.sparse.indices.byteOffset);
        to.sparse_index_component = static_cast<uint32_t>(from.sparse.indices.componentType);
        to.sparse_value_view = from.sparse.values.bufferView;
        to.sparse_value_offset = static_cast<uint64_t>(from.sparse.values.byteOffset);
    }
    return to;
}

int32_t attribute(const std::map<std::string, int> &attributes, const char *name)
{
    auto it = attributes.find(name);
    return it == attributes.end() ? -1 : it->second;
}

const tinygltf::Value *list(const tinygltf::Value *object, const char *key)
{
    return object && object->Has(key) && object->Get(key).IsArray() ? &object->Get(key) : nullptr;
}

void add_mappings(const tinygltf::Primitive &from, Owner &owner)
{
    const tinygltf::Value *mappings =
        list(find(from.extensions, "KHR_materials_variants"), "mappings");
    for (size_t i = 0; mappings && i < mappings->ArrayLen(); i++) {
        const tinygltf::Value &mapping = mappings->Get(static_cast<int>(i));
        const tinygltf::Value *variants = list(&mapping, "variants");
        for (size_t k = 0; variants && k < variants->ArrayLen(); k++)
            owner.mappings.push_back(
                {static_cast<uint32_t>(variants->Get(static_cast<int>(k)).GetNumberAsDouble()),
                    integer(mapping, "material", -1)});
    }
}

gltf_primitive convert(const tinygltf::Primitive &from, Owner &owner)
{
    gltf_primitive to = {};
    to.mode = static_cast<uint32_t>(from.mode);
    to.indices = from.indices;
    to.material = from.material;
    to.first_mapping = static_cast<uint32_t>(owner.mappings.size());
    add_mappings(from, owner);
    to.mapping_count = static_cast<uint32_t>(owner.mappings.size()) - to.first_mapping;
    to.position = attribute(from.attributes, "POSITION");
    to.normal = attribute(from.attributes, "NORMAL");
    to.tangent = attribute(from.attributes, "TANGENT");
    for (int i = 0; i < GLTF_UV_SETS; i++)
        to.uv[i] = attribute(from.attributes, ("TEXCOORD_" + std::to_string(i)).c_str());
    to.color = attribute(from.attributes, "COLOR_0");
    to.joints[0] = attribute(from.attributes, "JOINTS_0");
    to.joints[1] = attribute(from.attributes, "JOINTS_1");
    to.weights[0] = attribute(from.attributes, "WEIGHTS_0");
    to.weights[1] = attribute(from.attributes, "WEIGHTS_1");
    to.first_target = static_cast<uint32_t>(owner.targets.size());
    to.target_count = static_cast<uint32_t>(from.targets.size());
    for (const auto &target : from.targets)
        owner.targets.push_back({attribute(target, "POSITION"), attribute(target, "NORMAL"),
            attribute(target, "TANGENT")});
    return to;
}

gltf_node convert(const tinygltf::Node &from, Owner &owner)
{
    gltf_node to = {};
    to.has_matrix = from.matrix.size() == 16;
    numbers(from.matrix, to.matrix, 16);
    to.rotation[3] = 1;
    to.scale[0] = to.scale[1] = to.scale[2] = 1;
    numbers(from.translation, to.translation, 3);
    numbers(from.rotation, to.rotation, 4);
    numbers(from.scale, to.scale, 3);
    to.mesh = from.mesh;
    to.camera = from.camera;
    to.skin = from.skin;
    to.light = to.area_light = -1;
    to.instance_translation = to.instance_rotation = to.instance_scale = -1;
    if (const tinygltf::Value *use = find(from.extensions, "KHR_lights_punctual"))
        to.light = integer(*use, "light", -1);
    if (const tinygltf::Value *use = find(from.extensions, "EXT_lights_area"))
        to.area_light = integer(*use, "light", -1);
    if (const tinygltf::Value *use = find(from.extensions, "EXT_mesh_gpu_instancing")) {
        to.instanced = use->Has("attributes");
        const tinygltf::Value &attributes = use->Get("attributes");
        to.instance_translation = integer(attributes, "TRANSLATION", -1);
        to.instance_rotation = integer(attributes, "ROTATION", -1);
        to.instance_scale = integer(attributes, "SCALE", -1);
    }
    if (const tinygltf::Value *shown = find(from.extensions, "KHR_node_visibility"))
        to.hidden = shown->Has("visible") && shown->Get("visible").IsBool() &&
                    !shown->Get("visible").Get<bool>();
    to.first_child = static_cast<uint32_t>(owner.children.size());
    to.child_count = static_cast<uint32_t>(from.children.size());
    owner.children.insert(owner.children.end(), from.children.begin(), from.children.end());
    owner.keep(from.weights, to.first_weight, to.weight_count);
    bool named = to.camera >= 0 || to.light >= 0 || to.area_light >= 0;
    to.name = named ? owner.keep(from.name) : "";
    return to;
}

const char *alpha_mode(const std::string &mode)
{
    for (const char *known : {"OPAQUE", "MASK", "BLEND"})
        if (mode == known)
            return known;
    return "";
}

void dielectric(const tinygltf::Material &from, gltf_material &to)
{
    to.ior = 1.5f;
    to.specular_strength = to.specular[0] = to.specular[1] = to.specular[2] = 1;
    if (const tinygltf::Value *index = find(from.extensions, "KHR_materials_ior"))
        to.ior = static_cast<float>(number(*index, "ior", 1.5));
    if (const tinygltf::Value *transmission = find(from.extensions, "KHR_materials_transmission"))
        if (!transmission->Has("transmissionTexture"))
            to.transmission = static_cast<float>(number(*transmission, "transmissionFactor", 0));
    if (const tinygltf::Value *specular = find(from.extensions, "KHR_materials_specular")) {
        to.specular_strength = static_cast<float>(number(*specular, "specularFactor", 1));
        numbers(*specular, "specularColorFactor", to.specular, 3);
    }
}

gltf_material convert(const tinygltf::Material &from)
{
    gltf_material to = {};
    const tinygltf::PbrMetallicRoughness &pbr = from.pbrMetallicRoughness;
    for (float &c : to.base_color)
        c = 1;
    numbers(pbr.baseColorFactor, to.base_color, 4);
    numbers(from.emissiveFactor, to.emissive, 3);
    to.emissive_strength = 1;
    to.metallic = static_cast<float>(pbr.metallicFactor);
    to.roughness = static_cast<float>(pbr.roughnessFactor);
    to.glossiness = 1;
    dielectric(from, to);
    to.normal_scale = static_cast<float>(from.normalTexture.scale);
    to.occlusion_strength = static_cast<float>(from.occlusionTexture.strength);
    to.alpha_cutoff = static_cast<float>(from.alphaCutoff);
    to.alpha_mode = alpha_mode(from.alphaMode);
    to.double_sided = from.doubleSided;
    to.base = texture_info(pbr.baseColorTexture);
    to.surface = texture_info(pbr.metallicRoughnessTexture);
    to.normal = texture_info(from.normalTexture);
    to.occlusion = texture_info(from.occlusionTexture);
    to.emission = texture_info(from.emissiveTexture);
    to.unlit = find(from.extensions, "KHR_materials_unlit") != nullptr;
    if (const tinygltf::Value *strength = find(from.extensions, "KHR_materials_emissive_strength"))
        to.emissive_strength = static_cast<float>(number(*strength, "emissiveStrength", 1));
    if (const tinygltf::Value *old = find(from.extensions, "KHR_materials_pbrSpecularGlossiness")) {
        to.specular_glossiness = true;
        for (float &c : to.base_color)
            c = 1;
        for (float &c : to.specular)
            c = 1;
        numbers(*old, "diffuseFactor", to.base_color, 4);
        numbers(*old, "specularFactor", to.specular, 3);
        to.glossiness = static_cast<float>(number(*old, "glossinessFactor", 1));
        to.base = texture_info(*old, "diffuseTexture");
        to.surface = texture_info(*old, "specularGlossinessTexture");
    }
    return to;
}

gltf_texture convert(const tinygltf::Texture &from)
{
    static const char *const extensions[] = {
        "EXT_texture_webp", "EXT_texture_avif", "KHR_texture_basisu", "MSFT_texture_dds"};
    gltf_texture to = {{-1, -1, -1, -1, from.source}, from.sampler};
    for (size_t i = 0; i < GLTF_TEXTURE_SOURCES - 1; i++)
        if (const tinygltf::Value *extension = find(from.extensions, extensions[i]))
            to.images[i] = integer(*extension, "source", -1);
    return to;
}

gltf_camera convert(const tinygltf::Camera &from, Owner &owner)
{
    gltf_camera to = {};
    to.perspective = from.type == "perspective";
    to.fov_y = static_cast<float>(from.perspective.yfov);
    to.y_mag = static_cast<float>(from.orthographic.ymag);
    to.z_near =
        static_cast<float>(to.perspective ? from.perspective.znear : from.orthographic.znear);
    to.z_far = static_cast<float>(to.perspective ? from.perspective.zfar : from.orthographic.zfar);
    to.name = owner.keep(from.name);
    return to;
}

gltf_light convert(const tinygltf::Light &from, Owner &owner)
{
    gltf_light to = {};
    to.type = from.type == "directional" ? GLTF_LIGHT_DIRECTIONAL
              : from.type == "point"     ? GLTF_LIGHT_POINT
              : from.type == "spot"      ? GLTF_LIGHT_SPOT
                                         : GLTF_LIGHT_UNKNOWN;
    to.color[0] = to.color[1] = to.color[2] = 1;
    numbers(from.color, to.color, 3);
    to.intensity = static_cast<float>(from.intensity);
    to.inner_cone = static_cast<float>(from.spot.innerConeAngle);
    to.outer_cone = static_cast<float>(from.spot.outerConeAngle);
    to.name = owner.keep(from.name);
    return to;
}

gltf_light convert_area(const tinygltf::Value &from, Owner &owner)
{
    gltf_light to = {};
    std::string type = string(from, "type");
    to.type = type == "rect"   ? GLTF_LIGHT_RECT
              : type == "disk" ? GLTF_LIGHT_DISK
                               : GLTF_LIGHT_UNKNOWN;
    to.color[0] = to.color[1] = to.color[2] = 1;
    numbers(from, "color", to.color, 3);
    to.intensity = static_cast<float>(number(from, "intensity", 1000));
    to.size = static_cast<float>(number(from, "size", 1));
    to.aspect = 1;
    if (from.Has("rect"))
        to.aspect = static_cast<float>(number(from.Get("rect"), "aspect", 1));
    to.name = owner.keep(string(from, "name"));
    return to;
}

/* The scene that is shown: the default one, else the first; without scenes, every node that is
 * nobody's child. */
void choose_scene(const tinygltf::Model &model, Owner &owner, gltf_model &view)
{
    view.scene_count = static_cast<uint32_t>(model.scenes.size());
    view.scene = model.defaultScene >= 0 ? static_cast<uint32_t>(model.defaultScene) : 0;
    if (view.scene < model.scenes.size()) {
        owner.roots.assign(
            model.scenes[view.scene].nodes.begin(), model.scenes[view.scene].nodes.end());
        return;
    }
    std::vector<bool> is_child(owner.nodes.size());
    for (int32_t child : owner.children)
        if (static_cast<size_t>(child) < is_child.size())
            is_child[static_cast<size_t>(child)] = true;
    for (size_t i = 0; i < is_child.size(); i++)
        if (!is_child[i])
            owner.roots.push_back(static_cast<int32_t>(i));
}

void convert(const tinygltf::Model &model, Owner &owner, gltf_model &view)
{
    for (const auto &accessor : model.accessors)
        owner.accessors.push_back(convert(accessor));
    for (const auto &mesh : model.meshes) {
        gltf_mesh to = {static_cast<uint32_t>(owner.primitives.size()),
            static_cast<uint32_t>(mesh.primitives.size()), 0, 0};
        owner.keep(mesh.weights, to.first_weight, to.weight_count);
        owner.meshes.push_back(to);
        for (const auto &primitive : mesh.primitives)
            owner.primitives.push_back(convert(primitive, owner));
    }
    owner.nodes.reserve(model.nodes.size());
    for (const auto &node : model.nodes)
        owner.nodes.push_back(convert(node, owner));
    for (const auto &material : model.materials)
        owner.materials.push_back(convert(material));
    for (const auto &texture : model.textures)
        owner.textures.push_back(convert(texture));
    for (const auto &sampler : model.samplers)
        owner.samplers.push_back(
            {sampler.magFilter, sampler.minFilter, sampler.wrapS, sampler.wrapT});
    for (const auto &camera : model.cameras)
        owner.cameras.push_back(convert(camera, owner));
    for (const auto &light : model.lights)
        owner.lights.push_back(convert(light, owner));
    if (const tinygltf::Value *area = find(model.extensions, "EXT_lights_area"))
        if (area->Has("lights") && area->Get("lights").IsArray())
            for (size_t i = 0; i < area->Get("lights").ArrayLen(); i++)
                owner.area_lights.push_back(
                    convert_area(area->Get("lights").Get(static_cast<int>(i)), owner));
    const tinygltf::Value *variants =
        list(find(model.extensions, "KHR_materials_variants"), "variants");
    for (size_t i = 0; variants && i < variants->ArrayLen(); i++)
        owner.variants.push_back(owner.keep(string(variants->Get(static_cast<int>(i)), "name")));
    choose_scene(model, owner, view);
}

#define SHOW(view, owner, items, count)                                                            \
    ((view).items = (owner).items.data(),                                                          \
        (view).count = static_cast<uint32_t>((owner).items.size()))

void show(const Owner &owner, gltf_model &view)
{
    SHOW(view, owner, accessors, accessor_count);
    SHOW(view, owner, primitives, primitive_count);
    SHOW(view, owner, meshes, mesh_count);
    SHOW(view, owner, nodes, node_count);
    SHOW(view, owner, materials, material_count);
    SHOW(view, owner, textures, texture_count);
    SHOW(view, owner, samplers, sampler_count);
    SHOW(view, owner, cameras, camera_count);
    SHOW(view, owner, lights, light_count);
    SHOW(view, owner, area_lights, area_light_count);
    SHOW(view, owner, mappings, mapping_count);
    SHOW(view, owner, variants, variant_count);
    SHOW(view, owner, roots, root_count);
    view.children = owner.children.data();
    view.targets = owner.targets.data();
    view.weights = owner.weights.data();
}

/* The document that tinygltf sees has no URI left; whoever still asks for a file gets none. */
bool no_file_exists(const std::string &, void *)
{
    return false;
}

std::string no_path(const std::string &, void *)
{
    return std::string();
}

bool read_nothing(std::vector<unsigned char> *, std::string *, const std::string &, void *)
{
    return false;
}

bool write_nothing(std::string *, const std::string &, const std::vector<unsigned char> &, void *)
{
    return false;
}

/* Newer versions of tinygltf also ask how large a file is, and want this answered as well. */
template <class Callbacks>
auto refuse_sizes(Callbacks &files, int) -> decltype(files.GetFileSizeInBytes, void())
{
    files.GetFileSizeInBytes = [](size_t *, std::string *, const std::string &, void *) {
        return false;
    };
}

template <class Callbacks> void refuse_sizes(Callbacks &, long) {}

bool load_no_image(tinygltf::Image *, const int, std::string *, std::string *, int, int,
    const unsigned char *, int, void *)
{
    return false;
}

void parse(const char *text, size_t bytes, tinygltf::Model &model, struct pen_error *error)
{
    tinygltf::TinyGLTF loader;
    tinygltf::FsCallbacks files = {};
    files.FileExists = no_file_exists;
    files.ExpandFilePath = no_path;
    files.ReadWholeFile = read_nothing;
    files.WriteWholeFile = write_nothing;
    refuse_sizes(files, 0);
    loader.SetFsCallbacks(files);
    loader.SetImageLoader(load_no_image, nullptr);
    std::string failure, warning;
    if (!loader.LoadASCIIFromString(
            &model, &failure, &warning, text, static_cast<unsigned int>(bytes), "")) {
        failure = failure.substr(0, failure.find('\n'));
        size_t code_end = failure.find("] "); /* of "[json.exception.parse_error.101] " */
        if (failure.rfind("[json", 0) == 0 && code_end != std::string::npos)
            failure = failure.substr(code_end + 2);
        pen_fail(
            error, PEN_INVALID, "", "The glTF cannot be read: %s", imp_text(failure.c_str()).s);
    }
}

} // namespace

bool gltf_tiny_parse(
    const char *text, size_t bytes, struct gltf_model *view, struct pen_error *error)
{
    struct pen_error failure = {};
    memset(view, 0, sizeof *view);
    try {
        tinygltf::Model model;
        parse(text, bytes, model, &failure);
        if (failure.code == PEN_OK) {
            Owner *owner = new Owner;
            view->owner = owner;
            convert(model, *owner, *view);
            show(*owner, *view);
        }
    } catch (const std::bad_alloc &) {
        pen_fail(&failure, PEN_TOO_BIG, "", "The glTF needs more memory than an import may use.");
    } catch (const std::exception &) {
        pen_fail(&failure, PEN_INVALID, "", "The glTF cannot be read.");
    } catch (...) {
        pen_fail(&failure, PEN_INVALID, "", "The glTF cannot be read.");
    }
    if (failure.code == PEN_OK)
        return true;
    gltf_tiny_free(view);
    return pen_fail(
        error, static_cast<pen_code>(failure.code), failure.pointer, "%s", failure.message);
}

void gltf_tiny_free(struct gltf_model *view)
{
    delete static_cast<Owner *>(view->owner);
    memset(view, 0, sizeof *view);
}
