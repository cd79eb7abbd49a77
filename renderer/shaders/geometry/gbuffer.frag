// What shading needs of the nearest surface. TEXTURED: material textures are bound and alpha is
// tested; EMIT: a fourth target takes emission. Blended surfaces are there in a share alpha of
// their pixels, or SOLID: where they hide what is behind them, or LAYER: the nearest behind the
// layer before, of those that do not; the last layer is of a share again, for all behind it.
#include "view.glsl"
#include "octahedral.glsl"
#include "hash.glsl"
#include "material.glsl"

in vec3 v_position;
in vec3 v_normal;
in vec4 v_tangent;
in vec4 v_uv;
in vec4 v_color;

layout(location = 0) out vec4 out_normal; // geometric, shading
// Square root of albedo; a: 1 a lit surface, 0 the ground. LAYER: alpha.
layout(location = 1) out vec4 out_albedo;
layout(location = 2) out vec4 out_surface; // roughness, metallic, occlusion, F0 / 0.08
#ifdef EMIT
layout(location = 3) out vec3 out_emission;
#endif

#ifdef LAYER
layout(binding = UNIT_BEFORE) uniform sampler2D depth_before; // 1: there is none
layout(binding = UNIT_SOLID) uniform sampler2D depth_solid;
layout(location = LOCATION_LAST) uniform int last;
#endif

// Specular-glossiness to metallic-roughness: the metallic value whose mixture of base colour and
// dielectric reproduces both colours' brightness (solved as in the extension's appendix).
float solve_metallic(float diffuse, float specular)
{
    const float dielectric = 0.04;
    if (specular < dielectric)
        return 0.0;
    float one_minus = 1.0 - specular;
    float b = diffuse * one_minus / (1.0 - dielectric) + specular - 2.0 * dielectric;
    float c = dielectric - specular;
    return clamp(
        (-b + sqrt(max(b * b - 4.0 * dielectric * c, 0.0))) / (2.0 * dielectric), 0.0, 1.0);
}

float brightness(vec3 c)
{
    return sqrt(dot(c * c, vec3(0.299, 0.587, 0.114)));
}

void main()
{
    vec3 geometric = normalize(cross(dFdx(v_position), dFdy(v_position)));
    if (dot(geometric, v_position) > 0.0)
        geometric = -geometric;
    if (!(dot(geometric, geometric) > 0.5)) // a sliver without derivatives
        geometric = normalize(-v_position);
    vec3 shading = normalize(v_normal);
    if (!(dot(shading, shading) > 0.5))
        shading = geometric;
    float side = dot(shading, geometric) < 0.0 ? -1.0 : 1.0;
    shading *= side;
    // Derivatives of single-precision positions are good to about 1e-3; where the vertex normal
    // says the same (a flat face) it is the more exact one, and receiver planes need that at
    // grazing light.
    if (dot(shading, geometric) > 0.99998)
        geometric = shading;
#ifdef GROUND
    out_normal = vec4(octahedral_encode(vec3(0.0, geometric.y > 0.0 ? 1.0 : -1.0, 0.0)),
        octahedral_encode(shading));
    out_albedo = vec4(sqrt(view.ground_albedo.rgb), 0.0);
    out_surface = vec4(1.0, 0.0, 1.0, 0.0);
#ifdef EMIT
    out_emission = vec3(0.0);
#endif
#else
    Material m = materials[OWN_MATERIAL];
    vec3 emission = m.emissive.rgb;
    float metallic = m.surface.x, roughness = m.surface.y, occlusion = 1.0;
    float specular = min(0.5 * max(m.specular.r, max(m.specular.g, m.specular.b)), 1.0);
    vec3 f0 = m.specular.rgb;
    float glossiness = m.specular.a, cover = 1.0;
#ifdef TEXTURED
    vec4 base = material_base(OWN_MATERIAL, v_uv, v_color);
#ifdef SOLID
    float threshold = solid_alpha;
#else
    float threshold = pixel_threshold(gl_FragCoord.xyz, uint(view.display.z));
#endif
#ifdef LAYER
    // A little is taken twice, rather than by neither where two programs round differently or where
    // it lies on the ground.
    float before = texelFetch(depth_before, ivec2(gl_FragCoord.xy), 0).r;
    float solid = texelFetch(depth_solid, ivec2(gl_FragCoord.xy), 0).r;
    if (gl_FragCoord.z >= before || gl_FragCoord.z < 0.99999 * solid || base.a > solid_alpha + 1e-5)
        discard;
    threshold = last != 0 ? threshold : 0.0;
    cover = last != 0 ? 1.0 : base.a;
#endif
    if (alpha_is_cut(OWN_MATERIAL, base.a, threshold))
        discard;
    if (material_has(OWN_MATERIAL, SCENE_UNIT_SURFACE)) {
        vec4 t = material_sample(surface_map, OWN_MATERIAL, SCENE_UNIT_SURFACE, v_uv);
        metallic *= t.b;
        roughness *= t.g;
        f0 *= t.rgb;
        glossiness *= t.a;
    }
    if (material_has(OWN_MATERIAL, SCENE_UNIT_OCCLUSION))
        occlusion =
            1.0 +
            m.surface.z *
                (material_sample(occlusion_map, OWN_MATERIAL, SCENE_UNIT_OCCLUSION, v_uv).r - 1.0);
    if (material_has(OWN_MATERIAL, SCENE_UNIT_EMISSION))
        emission *= material_sample(emission_map, OWN_MATERIAL, SCENE_UNIT_EMISSION, v_uv).rgb;
    if (material_has(OWN_MATERIAL, SCENE_UNIT_NORMAL) && dot(v_tangent.xyz, v_tangent.xyz) > 0.0) {
        vec3 t = material_sample(normal_map, OWN_MATERIAL, SCENE_UNIT_NORMAL, v_uv).xyz * 2.0 - 1.0;
        t.xy *= m.surface.w;
        // From behind a surface bends the same way: all three vectors are turned round.
        vec3 tangent = normalize(v_tangent.xyz - shading * dot(v_tangent.xyz, shading));
        vec3 bitangent = cross(shading, tangent) * v_tangent.w;
        vec3 bent = normalize(side * tangent * t.x + bitangent * t.y + shading * t.z);
        if (dot(bent, bent) > 0.5)
            shading = bent;
    }
#else
    vec4 base = m.base_color * v_color;
#endif
    vec3 albedo = base.rgb;
    if ((m.flags.y & PSC_SPECULAR_GLOSSINESS) != 0u) {
        float strongest = max(f0.r, max(f0.g, f0.b));
        metallic = solve_metallic(brightness(albedo), brightness(f0));
        vec3 from_diffuse = albedo * (1.0 - strongest) / (0.96 * max(1.0 - metallic, 1e-4));
        vec3 from_specular = (f0 - 0.04 * (1.0 - metallic)) / max(metallic, 1e-4);
        albedo = clamp(mix(from_diffuse, from_specular, metallic * metallic), 0.0, 1.0);
        roughness = 1.0 - glossiness;
        specular = clamp(strongest / 0.08, 0.0, 1.0);
    }
    if ((m.flags.y & PSC_UNLIT) != 0u) {
        emission = albedo;
        albedo = vec3(0.0);
        specular = 0.0;
    }
    out_normal = vec4(octahedral_encode(geometric), octahedral_encode(shading));
    out_albedo = vec4(sqrt(clamp(albedo, 0.0, 1.0)), cover);
    out_surface = vec4(roughness, metallic, occlusion, specular);
#ifdef EMIT
    out_emission = emission;
#endif
#endif
}
