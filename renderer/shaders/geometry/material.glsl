// Materials and their textures.
#include "material.def"

// What has textures or holes is drawn material by material, with the first that is bound.
#if defined(TEXTURED) || defined(ALPHA)
#define OWN_MATERIAL 0u
#else
flat in uint v_material;
#define OWN_MATERIAL v_material
#endif

layout(binding = SCENE_UNIT_BASE) uniform sampler2D base_map;
layout(binding = SCENE_UNIT_SURFACE) uniform sampler2D surface_map;
layout(binding = SCENE_UNIT_NORMAL) uniform sampler2D normal_map;
layout(binding = SCENE_UNIT_OCCLUSION) uniform sampler2D occlusion_map;
layout(binding = SCENE_UNIT_EMISSION) uniform sampler2D emission_map;

bool material_has(uint material, int slot)
{
    return (materials[material].flags.z >> slot & 1u) != 0u;
}

vec2 material_uv(uint material, int slot, vec4 uv)
{
    vec2 t = (materials[material].flags.w >> slot & 1u) != 0u ? uv.zw : uv.xy;
    vec4 row0 = materials[material].transforms[2 * slot];
    vec4 row1 = materials[material].transforms[2 * slot + 1];
    return vec2(dot(row0.xy, t) + row0.z, dot(row1.xy, t) + row1.z);
}

// Samples with explicit derivatives: llvmpipe reads zeros from a buffer in the pixels of a 2 x 2
// block that the triangle does not cover, and implicit derivatives of coordinates that were
// transformed with them pick a wrong level along every edge.
struct Footprint {
    vec2 at, across, down; // in the texture; per pixel
};

Footprint material_footprint(uint material, int slot, vec4 uv)
{
    vec4 dx = dFdx(uv), dy = dFdy(uv);
    vec2 origin = material_uv(material, slot, vec4(0.0));
    return Footprint(material_uv(material, slot, uv), material_uv(material, slot, dx) - origin,
        material_uv(material, slot, dy) - origin);
}

vec4 material_sample(sampler2D map, uint material, int slot, vec4 uv)
{
    Footprint f = material_footprint(material, slot, uv);
    return textureGrad(map, f.at, f.across, f.down);
}

// Base colour with vertex colour; the caller tests the alpha.
vec4 material_base(uint material, vec4 uv, vec4 color)
{
    vec4 base = materials[material].base_color * color;
    if (material_has(material, SCENE_UNIT_BASE))
        base *= material_sample(base_map, material, SCENE_UNIT_BASE, uv);
    return base;
}

const float solid_alpha = float(SOLID_PER_MILLE) / 1000.0;

// Blended surfaces are cut by a threshold; an alpha that is no number is 0.
bool alpha_is_cut(uint material, float alpha, float threshold)
{
    uint mode = materials[material].flags.x;
    if (mode == PSC_MASK)
        return alpha < materials[material].emissive.w;
    return mode == PSC_BLEND && !(alpha > threshold);
}
