// Casters. Only groups with an alpha test run this with ALPHA defined.
#ifdef ALPHA
#include "hash.glsl"
#include "material.glsl"
uniform uint seed; // of the hashed threshold: differs between maps that are averaged
in vec4 v_uv;
in vec4 v_color;
flat in uint v_material;
#endif

void main()
{
#ifdef ALPHA
    float alpha = material_base(v_material, v_uv, v_color).a;
    float threshold = unit_float(hash3(uvec3(gl_FragCoord.xy, seed)).x);
    if (alpha_is_cut(v_material, alpha, threshold))
        discard;
#endif
}
