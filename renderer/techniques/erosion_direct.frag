// Klein et al. 2014, variant direct: the shadow factor from the distance to the nearest edge. Their
// s_outer = (w - d) / 2w with w half the penumbra, as visibility and over both sides at once.
#include "erosion_line.glsl"
#include "pixel_horizon.glsl"
layout(binding = UNIT_SEEDS) uniform sampler2D seeds;
layout(location = 0) out vec4 vis;

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 hard = texelFetch(hard_map, pixel, 0);
    if (hard.x == 1.0 && hard.z == 0.0)
        discard;
    vec2 to = texelFetch(seeds, pixel, 0).rg;
    float v = hard.x;
    if (to.x != FAR) {
        float t = edge_distance(texelFetch(lines, pixel + ivec2(to), 0), to,
            texelFetch(axes_map, pixel, 0), plane_at(pixel), hard.x > 0.5);
        t = clamp(t, -1.0, 1.0);
        // A straight edge across a rectangle gives a linear ramp, across a disk its chord's area.
        v = light.shape == SHAPE_DISK ? 0.5 + (t * sqrt(1.0 - t * t) + asin(t)) / 3.14159265
                                      : 0.5 + 0.5 * t;
        v = abs(t) < 1.0 ? v : hard.x;
    }
    vis = scalar_visibility(light.cube != 0 ? v : pixel_horizon_fade(pixel) * v);
}
