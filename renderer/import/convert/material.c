#include "renderer/import/convert/material.h"
#include "renderer/import/convert/texture.h"
#include <math.h>
#include <string.h>

/* KHR_texture_transform as uv' = T R S uv. The angle turns counter-clockwise as seen with v
 * pointing down, hence the signs: what the text of the extension says and viewers do. */
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
    float c = cosf(info->rotation), s = sinf(info->rotation);
    const float transform[6] = {c * info->scale[0], s * info->scale[1], info->offset[0],
        -s * info->scale[0], c * info->scale[1], info->offset[1]};
    for (int i = 0; i < 6; i++)
        if (!isfinite(transform[i]))
            return ref; /* the identity */
    memcpy(ref.transform, transform, sizeof transform);
    return ref;
}

#define STRONGEST 25 /* of 0.04: everything is reflected */

static float clamp01(float x)
{
    return x > 0 ? fminf(x, 1) : 0;
}

static struct psc_material convert(struct imp_context *context, const struct gltf_material *from)
{
    struct psc_material to = psc_material_default();
    for (int i = 0; i < 4; i++)
        to.base_color[i] = clamp01(from->base_color[i]);
    for (int i = 0; i < 3; i++) {
        to.emissive[i] = fminf(fmaxf(from->emissive[i] * from->emissive_strength, 0), 1e9f);
        to.specular[i] =
            fminf(fmaxf(from->specular[i], 0), from->specular_glossiness ? 1 : STRONGEST);
    }
    to.metallic = clamp01(from->metallic);
    to.roughness = clamp01(from->roughness);
    to.glossiness = clamp01(from->glossiness);
    to.normal_scale = from->normal_scale;
    to.occlusion_strength = clamp01(from->occlusion_strength);
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

bool imp_material_has_normal_map(const struct imp_context *context, int32_t material)
{
    return material >= 0 && (uint32_t)material < context->model->material_count &&
           context->model->materials[material].normal.texture >= 0;
}
