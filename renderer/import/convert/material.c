#include "renderer/import/convert/material.h"
#include "renderer/import/convert/texture.h"
#include "renderer/pose/place.h"
#include <math.h>
#include <string.h>

static void add_sets(const struct gltf_material *m, uint32_t *sets, uint32_t *count)
{
    const struct gltf_texture_info *maps[] = {
        &m->base, &m->normal, &m->surface, &m->emission, &m->occlusion};
    for (size_t i = 0; i < sizeof maps / sizeof *maps; i++) {
        bool known = maps[i]->texture < 0 || maps[i]->uv_set >= GLTF_UV_SETS;
        for (uint32_t k = 0; k < *count; k++)
            known |= sets[k] == maps[i]->uv_set;
        if (!known)
            sets[(*count)++] = maps[i]->uv_set;
    }
}

static void first_two(const uint32_t *from, uint32_t count, uint32_t sets[2])
{
    bool usual = (count < 1 || from[0] < 2) && (count < 2 || from[1] < 2);
    sets[0] = usual ? 0 : from[0];
    sets[1] = usual ? 1 : from[count > 1];
}

void imp_material_uv_sets(struct imp_context *context, int32_t material, uint32_t sets[2])
{
    const struct gltf_model *model = context->model;
    struct imp_uv_sets *plan = &context->uv_sets;
    uint32_t used[GLTF_UV_SETS], count = 0;
    if (!plan->planned) {
        for (uint32_t i = 0; i < model->material_count; i++)
            add_sets(&model->materials[i], used, &count);
        first_two(used, count, plan->sets);
        plan->few = count <= 2;
        plan->planned = true;
        count = 0;
    }
    if (!plan->few && material >= 0 && (uint32_t)material < model->material_count)
        add_sets(&model->materials[material], used, &count);
    if (plan->few)
        memcpy(sets, plan->sets, sizeof plan->sets);
    else
        first_two(used, count, sets);
}

/* Of a material that uses `sets`. */
static struct psc_texture_ref texture_ref(struct imp_context *context, const uint32_t sets[2],
    const struct gltf_texture_info *info, enum imp_role role)
{
    struct psc_texture_ref ref = psc_material_default().base;
    if (info->texture < 0)
        return ref;
    ref.texture = imp_texture(context, info->texture, role);
    ref.uv_set = sets[0] != info->uv_set && sets[1] == info->uv_set;
    if (sets[ref.uv_set] != info->uv_set)
        imp_warn(context,
            "A material's textures may use two sets of texture coordinates; set %u becomes %u.",
            info->uv_set, sets[0]);
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
    uint32_t sets[2];
    imp_material_uv_sets(context, (int32_t)(from - context->model->materials), sets);
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
    to.base = texture_ref(context, sets, &from->base, IMP_BASE);
    to.surface = texture_ref(
        context, sets, &from->surface, from->specular_glossiness ? IMP_GLOSS : IMP_SURFACE);
    to.normal = texture_ref(context, sets, &from->normal, IMP_NORMAL);
    to.occlusion = texture_ref(context, sets, &from->occlusion, IMP_OCCLUSION);
    to.emission = texture_ref(context, sets, &from->emission, IMP_EMISSION);
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
    struct imp_context *context, int32_t material, struct psc_texture_ref *map)
{
    if (material < 0 || (uint32_t)material >= context->model->material_count)
        return false;
    const struct gltf_texture_info *info = &context->model->materials[material].normal;
    const struct psc_map_rest rest = map_rest(info);
    *map = psc_material_default().normal;
    uint32_t sets[2];
    imp_material_uv_sets(context, material, sets);
    map->uv_set = sets[0] != info->uv_set && sets[1] == info->uv_set;
    pose_texture_transform(&rest, map->transform);
    return info->texture >= 0;
}
