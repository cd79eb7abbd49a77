// One level of an edge-avoiding a-trous transform (Dammertz et al. 2010): 5 x 5 taps of the cubic
// B-spline, `step` pixels apart, bounded by the penumbra's own Gaussian (axis-aligned filtering,
// Mehta et al. 2012), so that contacts stay sharp. Needs P(blur), P(depth_sigma), P(normal_power).
#include "surface_difference.glsl"
#include "light_ratio.glsl"
#include "atrous.def"

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = ivec2(view.viewport.xy) - 1;
    vec4 spread = texelFetch(spread_map, pixel, 0);
    if (spread_is_lit(spread))
        discard;
    vec2 deviation = max(P(blur) * spread.yw, 0.25);
    Plane plane = plane_at(pixel);
    RATIO own = ratio_at(pixel), sum = own * 1e-4;
    float total = 1e-4;
    bool wide = max(spread.y, spread.w) > 0.1;
    // Samples that disagree where the centre of the light saw no penumbra: a pixel or two.
    if (!wide && ratio_is_mixed(own)) {
        wide = true;
        spread.z = 0.0;
        deviation = vec2(1.5);
    }
    int n = wide ? level.step.y : -1;
    for (int y = -n; y <= n; y++)
        for (int x = -n; x <= n; x++) {
            ivec2 offset = ivec2(x, y) * level.step.x, at = pixel + offset;
            float inside = all(equal(at, clamp(at, ivec2(0), last))) ? 1.0 : 0.0;
            at = clamp(at, ivec2(0), last);
            vec2 d =
                vec2(float(offset.x) - spread.z * float(offset.y), float(offset.y)) / deviation;
            vec2 spline = vec2(x == 0        ? 0.375
                               : abs(x) == 1 ? 0.25
                                             : 0.0625,
                y == 0        ? 0.375
                : abs(y) == 1 ? 0.25
                              : 0.0625);
            float w = inside * spline.x * spline.y *
                      exp(-0.5 * dot(d, d) - surface_difference(plane, at, offset));
            sum += w * ratio_at(at);
            total += w;
        }
    ratio_write(pixel, sum / total);
}
