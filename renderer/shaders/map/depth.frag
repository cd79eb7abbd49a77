// Casters. Only groups with an alpha test run this with ALPHA defined.
#ifdef ALPHA
#include "hash.glsl"
#include "material.glsl"
layout(location = LOCATION_SEED)
    uniform uint seed; // of the hashed threshold: differs between maps that are averaged
in vec4 v_uv;
in vec4 v_color;
#endif

#ifdef PEEL // only what lies behind the layer before
layout(binding = UNIT_SOURCE) uniform sampler2D layer_before;
#endif

void main()
{
#ifdef PEEL
    // A few units of least precision: two programs may round one surface differently.
    if (gl_FragCoord.z <= texelFetch(layer_before, ivec2(gl_FragCoord.xy), 0).r + 4e-7)
        discard;
#endif
#ifdef ALPHA
    float alpha = material_base(OWN_MATERIAL, v_uv, v_color).a;
    float threshold = pixel_threshold(gl_FragCoord.xyz, seed);
    if (alpha_is_cut(OWN_MATERIAL, alpha, threshold))
        discard;
#endif
}
