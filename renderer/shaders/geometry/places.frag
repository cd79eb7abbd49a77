// Which of the places in a pixel a surface covers. ALPHA: its material cuts holes; alpha is read
// once per pixel and carried on to the places along its gradient.
#ifdef ALPHA
#include "material.glsl"
#include "edges.def"

in vec4 v_uv;
in vec4 v_color;
flat in uint v_material;
#endif

void main()
{
#ifdef ALPHA
    float alpha = material_base(v_material, v_uv, v_color).a;
    vec2 slope = vec2(dFdx(alpha), dFdy(alpha));
    int covered = 0;
    for (int i = 0; i < EDGE_PLACES; i++)
        if (!alpha_is_cut(v_material, alpha + dot(slope, vec2(edge.across[i], edge.down[i])), 0.0))
            covered |= 1 << i;
    gl_SampleMask[0] = covered;
#endif
}
