// One step of jump flooding (Rong and Tan 2006): each pixel keeps the offset of the edge that is
// nearest in half penumbra widths, among those on its own plane. FIRST: every edge is its own seed.
#include "erosion_line.glsl"
#include "erosion_flood.def"
layout(binding = UNIT_SEEDS) uniform sampler2D seeds;
layout(location = 0) out vec2 seed;

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = ivec2(view.viewport.xy) - 1;
    vec4 hard = texelFetch(hard_map, pixel, 0);
    if (hard.z == 0.0)
        discard; // no penumbra can reach here: FAR, as the target starts
    vec4 axes = texelFetch(axes_map, pixel, 0);
    Plane plane = plane_at(pixel);
    float best = FAR;
    seed = vec2(FAR);
    for (int i = 0; i < 9; i++) {
        ivec2 jump = (ivec2(i % 3, i / 3) - 1) * flood.step.x, at = pixel + jump;
        if (at != clamp(at, ivec2(0), last))
            continue;
#ifdef FIRST
        vec2 to = vec2(jump);
#else
        vec2 to = texelFetch(seeds, at, 0).rg;
        if (to.x == FAR)
            continue;
        to += vec2(jump);
#endif
        ivec2 edge = pixel + ivec2(to);
        float d = abs(edge_distance(texelFetch(lines, edge, 0), to, axes, plane, hard.x > 0.5));
        if (d < best && abs(plane_distance(plane, edge, ivec2(to))) < 2.0) {
            best = d;
            seed = to;
        }
    }
}
