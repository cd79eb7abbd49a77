// Which of the places in a pixel a surface covers. ALPHA: its material cuts holes, and its
// texture is read at each. SOLID: only what hides what is behind it.
#ifdef ALPHA
#include "material.glsl"
#include "edges.def"

in vec4 v_uv;
in vec4 v_color;
#endif

#ifdef SOLID
#define THRESHOLD solid_alpha
#else
#define THRESHOLD 0.0
#endif

void main()
{
#ifdef ALPHA
    Footprint f = material_footprint(OWN_MATERIAL, SCENE_UNIT_BASE, v_uv);
    bool textured = material_has(OWN_MATERIAL, SCENE_UNIT_BASE);
    float whole = materials[OWN_MATERIAL].base_color.a * v_color.a;
    int covered = 0;
    for (int i = 0; i < EDGE_PLACES; i++) {
        vec2 at = f.at + edge.across[i] * f.across + edge.down[i] * f.down;
        float alpha = textured ? whole * textureGrad(base_map, at, f.across, f.down).a : whole;
        if (!alpha_is_cut(OWN_MATERIAL, alpha, THRESHOLD))
            covered |= 1 << i;
    }
    gl_SampleMask[0] = covered;
#endif
}
