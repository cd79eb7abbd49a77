#include "renderer/import/convert/material.h"
#include "renderer/import/convert/texture.h"
#include "renderer/pose/place.h"
#include <math.h>
#include <string.h>

static struct psc_texture_ref texture_ref(
    struct imp_context *context, const struct gltf_texture_info *info, enum imp_role role)
{
    struct psc_texture_ref ref = psc_material_default().base;
    if (info->texture < 0)
        return ref;
    ref.texture = imp_texture(context, info->texture, role);
    if (info->uv_set > 1)
        imp_warn(context, "Only the texture coordinate sets 0 and 1 are used; set %u becomes 0.",
            info->uv_set);
    else
        ref.uv_set = info->uv_set;
    return ref;
}

static struct psc_map_rest map_rest(const struct gltf_texture_info *info)
{
    return (struct psc_map_rest){
        {info->offset[0], info->offset[1]}, info->rotation, {info->scale[0], info->scale[1]}};
}

struct psc_material_rest imp_material_rest(const struct gltf_material *from)
{
    return (struct psc_material_rest){
        .emissive = {from->emissive[0], from->emissive[1], from->emissive[2]},
        .emissive_strength = from->emissive_strength,
        .ior = from->ior,
        .specular_strength = from->specular_strength,
        .specular = {from->specular[0], from->specular[1], from->specular[2]},
        .maps = {map_rest(&from->base), map_rest(&from->surface), map_rest(&from->normal),
            map_rest(&from->occlusion), map_rest(&from->emission)}};
}

static float clamp01(float x)
{
    return x > 0 ? fminf(x, 1) : 0;
}

#define FILM 0.15f /* what clear glass covers of what is behind it, with what it reflects */

/* Light that passes through is drawn as surfaces that cover little. An opaque material's textures may
 * have any alpha, and then it stays so. */
static void let_through(struct psc_material *to, const struct gltf_material *from)
{
    float through = clamp01(from->transmission) * (1 - clamp01(from->metallic));
    bool opaque = to->alpha_mode == PSC_OPAQUE;
    if (through <= 0 || to->alpha_mode == PSC_MASK || (opaque && to->base.texture >= 0))
        return;
    to->alpha_mode = PSC_BLEND;
    to->base_color[3] = (opaque ? 1 : to->base_color[3]) * (1 - (1 - FILM) * through);
}

static struct psc_material convert(struct imp_context *context, const struct gltf_material *from)
{
    struct psc_material to = psc_material_default();
    memcpy(to.base_color, from->base_color, sizeof to.base_color);
    for (int i = 0; i < 3; i++)
        to.specular[i] = clamp01(from->specular[i]);
    to.metallic = from->metallic;
    to.roughness = from->roughness;
    to.glossiness = clamp01(from->glossiness);
    to.normal_scale = from->normal_scale;
    to.occlusion_strength = from->occlusion_strength;
    to.alpha_cutoff = from->alpha_cutoff;
    if (!strcmp(from->alpha_mode, "MASK"))
        to.alpha_mode = PSC_MASK;
    else if (!strcmp(from->alpha_mode, "BLEND"))
        to.alpha_mode = PSC_BLEND;
    else if (strcmp(from->alpha_mode, "OPAQUE"))
        imp_warn(context, "A material's unknown alphaMode is taken for OPAQUE.");
    to.flags = (from->double_sided ? PSC_DOUBLE_SIDED : 0) | (from->unlit ? PSC_UNLIT : 0) |
               (from->specular_glossiness ? PSC_SPECULAR_GLOSSINESS : 0);
    to.base = texture_ref(context, &from->base, IMP_BASE);
    to.surface =
        texture_ref(context, &from->surface, from->specular_glossiness ? IMP_GLOSS : IMP_SURFACE);
    to.normal = texture_ref(context, &from->normal, IMP_NORMAL);
    to.occlusion = texture_ref(context, &from->occlusion, IMP_OCCLUSION);
    to.emission = texture_ref(context, &from->emission, IMP_EMISSION);
    let_through(&to, from);
    const struct psc_material_rest rest = imp_material_rest(from);
    pose_finish_material(&to, &rest);
    return to;
}

/* A primitive without a material gets the builder's default, a rough white dielectric, where the
 * specification has a rough white metal: those who left it out meant paper, not chalky silver. */
uint32_t imp_material(struct imp_context *context, int32_t material)
{
    uint32_t count = context->model->material_count;
    uint32_t slot = material < 0 || (uint32_t)material >= count ? count : (uint32_t)material;
    if (context->materials[slot] == IMP_NOT_YET) {
        struct psc_material m = slot < count ? convert(context, &context->model->materials[slot])
                                             : psc_material_default();
        context->materials[slot] = psc_builder_add_material(context->builder, &m);
    }
    return context->materials[slot];
}

bool imp_material_normal_map(
    const struct imp_context *context, int32_t material, struct psc_texture_ref *map)
{
    if (material < 0 || (uint32_t)material >= context->model->material_count)
        return false;
    const struct gltf_texture_info *info = &context->model->materials[material].normal;
    const struct psc_map_rest rest = map_rest(info);
    *map = psc_material_default().normal;
    map->uv_set = info->uv_set > 1 ? 0 : info->uv_set;
    pose_texture_transform(&rest, map->transform);
    return info->texture >= 0;
}
