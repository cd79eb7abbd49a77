/* What an animation's channel moves: a node's path, or a JSON pointer (KHR_animation_pointer). */
#include "renderer/import/motion/aim.h"
#include <ctype.h>
#include <stdlib.h>
#include <string.h>

struct named {
    const char *name;
    int32_t target;
};

static const struct named node_paths[] = {
    {"translation", PSC_TO_NODE_TRANSLATION},
    {"rotation", PSC_TO_NODE_ROTATION},
    {"scale", PSC_TO_NODE_SCALE},
    {"weights", PSC_TO_WEIGHTS},
    {"extensions/KHR_node_visibility/visible", PSC_TO_NODE_VISIBLE},
};

static const struct named material_paths[] = {
    {"pbrMetallicRoughness/baseColorFactor", PSC_TO_MATERIAL_BASE_COLOR},
    {"pbrMetallicRoughness/metallicFactor", PSC_TO_MATERIAL_METALLIC},
    {"pbrMetallicRoughness/roughnessFactor", PSC_TO_MATERIAL_ROUGHNESS},
    {"emissiveFactor", PSC_TO_MATERIAL_EMISSIVE},
    {"extensions/KHR_materials_emissive_strength/emissiveStrength",
        PSC_TO_MATERIAL_EMISSIVE_STRENGTH},
    {"extensions/KHR_materials_ior/ior", PSC_TO_MATERIAL_IOR},
    {"extensions/KHR_materials_specular/specularFactor", PSC_TO_MATERIAL_SPECULAR_STRENGTH},
    {"extensions/KHR_materials_specular/specularColorFactor", PSC_TO_MATERIAL_SPECULAR},
    {"alphaCutoff", PSC_TO_MATERIAL_ALPHA_CUTOFF},
    {"normalTexture/scale", PSC_TO_MATERIAL_NORMAL_SCALE},
    {"occlusionTexture/strength", PSC_TO_MATERIAL_OCCLUSION_STRENGTH},
};

/* In the order of psc_material_rest.maps. */
static const char *const maps[5] = {"pbrMetallicRoughness/baseColorTexture",
    "pbrMetallicRoughness/metallicRoughnessTexture", "normalTexture", "occlusionTexture",
    "emissiveTexture"};
static const struct named map_paths[] = {
    {"/extensions/KHR_texture_transform/offset", PSC_TO_TEXTURE_OFFSET},
    {"/extensions/KHR_texture_transform/rotation", PSC_TO_TEXTURE_ROTATION},
    {"/extensions/KHR_texture_transform/scale", PSC_TO_TEXTURE_SCALE},
};

static const struct named light_paths[] = {
    {"color", PSC_TO_LIGHT_COLOR},
    {"intensity", PSC_TO_LIGHT_INTENSITY},
    {"spot/innerConeAngle", PSC_TO_LIGHT_INNER_CONE},
    {"spot/outerConeAngle", PSC_TO_LIGHT_OUTER_CONE},
};

static const struct named camera_paths[] = {{"perspective/yfov", PSC_TO_CAMERA_FOV}};

#define FIND(list, name) find(list, sizeof list / sizeof *list, name)

static int32_t find(const struct named *list, size_t count, const char *name)
{
    for (size_t i = 0; i < count; i++)
        if (!strcmp(list[i].name, name))
            return list[i].target;
    return -1;
}

/* Cuts "/array/12/" off the pointer; false when it starts otherwise or there is no such item. */
static bool enter(const char **pointer, const char *array, uint32_t count, uint32_t *item)
{
    size_t length = strlen(array);
    const char *at = *pointer + length;
    if (strncmp(*pointer, array, length) || !isdigit((unsigned char)*at))
        return false;
    char *end;
    unsigned long number = strtoul(at, &end, 10);
    if (*end != '/' || number >= count)
        return false;
    *item = (uint32_t)number;
    *pointer = end + 1;
    return true;
}

static void aim_at_material(struct imp_aim *aim, const char *path)
{
    aim->target = FIND(material_paths, path);
    for (uint32_t i = 0; aim->target < 0 && i < 5; i++) {
        size_t length = strlen(maps[i]);
        if (strncmp(path, maps[i], length))
            continue;
        aim->target = FIND(map_paths, path + length);
        aim->part = i;
    }
}

static void aim_at_node(struct imp_aim *aim, const char *path)
{
    char *end;
    aim->target = FIND(node_paths, path);
    if (strncmp(path, "weights/", 8) || !isdigit((unsigned char)path[8]))
        return;
    unsigned long part = strtoul(path + 8, &end, 10);
    if (*end || part >= UINT16_MAX)
        return;
    aim->target = PSC_TO_WEIGHTS;
    aim->part = (uint32_t)part + 1;
}

struct imp_aim imp_aim(struct imp_context *context, const struct gltf_channel *channel)
{
    const struct gltf_model *model = context->model;
    struct imp_aim aim = {.target = -1};
    const char *pointer = channel->pointer;
    if (strcmp(channel->path, "pointer")) {
        if (channel->node < 0)
            return aim; /* glTF 2.0, 3.11: to be ignored */
        aim.item = (uint32_t)channel->node;
        aim.target = strchr(channel->path, '/') ? -1 : FIND(node_paths, channel->path);
    } else if (pointer && enter(&pointer, "/nodes/", model->node_count, &aim.item)) {
        aim_at_node(&aim, pointer);
    } else if (pointer && enter(&pointer, "/meshes/", model->mesh_count, &aim.item)) {
        aim_at_node(&aim, pointer);
        aim.target = aim.target == PSC_TO_WEIGHTS ? PSC_TO_WEIGHTS : -1;
        aim.mesh = true;
    } else if (pointer && enter(&pointer, "/materials/", model->material_count, &aim.item)) {
        aim_at_material(&aim, pointer);
    } else if (pointer && enter(&pointer, "/extensions/KHR_lights_punctual/lights/",
                              model->light_count, &aim.item)) {
        aim.target = FIND(light_paths, pointer);
    } else if (pointer && enter(&pointer, "/cameras/", model->camera_count, &aim.item)) {
        aim.target = FIND(camera_paths, pointer);
    }
    if (aim.target < 0)
        imp_warn(context, "Some of what the animations change is not drawn.");
    return aim;
}
