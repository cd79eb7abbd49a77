// Which of the places in a pixel a surface covers. ALPHA: its material cuts holes; alpha is read
// once per pixel and carried on to the places along its gradient. SOLID: only what hides what is
// behind it.
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
    float alpha = material_base(v_material, v_uv, v_color).a;
    vec2 slope = vec2(dFdx(alpha), dFdy(alpha));
    int covered = 0;
    for (int i = 0; i < EDGE_PLACES; i++)
        if (!alpha_is_cut(
                v_material, alpha + dot(slope, vec2(edge.across[i], edge.down[i])), THRESHOLD))
            covered |= 1 << i;
    gl_SampleMask[0] = covered;
#endif
}
