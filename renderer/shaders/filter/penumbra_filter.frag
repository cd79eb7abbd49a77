// One of the two lines of an anisotropic Gaussian (see screen_spread); SECOND: along (skew, 1).
// Needs P(sigma), P(filter_taps), P(depth_sigma) and P(normal_power).
#include "surface_difference.glsl"
#include "light_ratio.glsl"
#include "dither.glsl"
#include "light_gauss.glsl"

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = ivec2(view.viewport.xy) - 1;
    vec4 spread = texelFetch(spread_map, pixel, 0);
    if (spread_is_lit(spread))
        discard;
#ifdef SECOND
    vec2 reach = P(sigma) / light_gauss_deviation * spread.w * vec2(spread.z, 1.0);
    float shift = dither(pixel.yx, view.display.z);
#else
    vec2 reach = vec2(P(sigma) / light_gauss_deviation * spread.y, 0.0);
    float shift = dither(pixel, view.display.z);
#endif
    // Taps lie at least a pixel apart; where they are farther, each pixel shifts them.
    float pixels = max(abs(reach.x), abs(reach.y));
    int n = pixels < 0.6 ? 0 : min(int(P(filter_taps)), int(ceil(pixels)));
    shift = pixels > 1.5 * float(n) ? shift - 0.5 : 0.0;
    Plane plane = plane_at(pixel);
    // Equal steps on the receiver are shorter on the screen away from the camera.
    float tilt = clamp(dot(plane.gradient, reach) / plane.depth, -0.7, 0.7);
    float scale = 1.0 / float(max(n, 1));
    float falloff = -0.5 / (light_gauss_falloff * light_gauss_falloff);
    RATIO sum = ratio_at(pixel);
    float total = 1e-3;
    sum *= total;
    int first = n > 0 ? -n : 0, end = n > 0 ? n : -1;
    for (int k = first; k <= end; k++) {
        float t = (float(k) + shift) * scale;
        ivec2 offset = ivec2(round(reach * (t / (1.0 - tilt * t))));
        ivec2 at = pixel + offset;
        float inside = all(equal(at, clamp(at, ivec2(0), last))) ? 1.0 : 0.0;
        at = clamp(at, ivec2(0), last);
        float w = inside * exp(falloff * t * t - surface_difference(plane, at, offset));
        sum += w * ratio_at(at);
        total += w;
    }
    ratio_write(pixel, sum / total);
}
