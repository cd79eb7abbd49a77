// Which of the places in a pixel a surface covers. ALPHA: its material cuts holes, and its
// texture is read at each. SOLID: only what hides what is behind it.
#ifdef ALPHA
#include "material.glsl"
#include "edges.def"

in vec4 v_uv;
in vec4 v_color;
flat in uint v_material;
#endif

#ifdef SOLID
#define THRESHOLD solid_alpha
#else
#define THRESHOLD 0.0
#endif

void main()
{
#ifdef ALPHA
    vec4 across = dFdx(v_uv), down = dFdy(v_uv);
    int covered = 0;
    for (int i = 0; i < EDGE_PLACES; i++) {
        vec4 uv = v_uv + edge.across[i] * across + edge.down[i] * down;
        if (!alpha_is_cut(v_material, material_base(v_material, uv, v_color).a, THRESHOLD))
            covered |= 1 << i;
    }
    gl_SampleMask[0] = covered;
#endif
}
