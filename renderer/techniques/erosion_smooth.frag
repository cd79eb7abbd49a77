// Averages each fitted line with those of the same edge farther along it: where a nearly upright
// edge steps aside by a pixel, a short fit takes the step for a slope, and under a rectangular
// light the width of the penumbra depends on that. Needs P(fit_radius).
#include "view.glsl"
#include "erosion.def"
layout(binding = UNIT_LINES) uniform sampler2D lines;
layout(location = 0) out vec4 line;

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = ivec2(view.viewport.xy) - 1;
    line = texelFetch(lines, pixel, 0);
    int r = line.w > 0.0 ? 3 * int(P(fit_radius)) : -1;
    float falloff = -2.0 / float(9 * P(fit_radius) * P(fit_radius)), total = 0.0, width = 0.0;
    vec2 normal = vec2(0.0), point = vec2(0.0);
    for (int y = -r; y <= r; y++)
        for (int x = -r; x <= r; x++) {
            ivec2 at = clamp(pixel + ivec2(x, y), ivec2(0), last);
            vec4 other = texelFetch(lines, at, 0);
            vec2 offset = vec2(at - pixel), on = offset + other.z * other.xy;
            // The same edge runs on in about the same direction and within a pixel or so.
            bool same = other.w > 0.0 && abs(other.w - line.w) < 0.25 * line.w &&
                        dot(other.xy, line.xy) > 0.85 && abs(dot(on, line.xy) - line.z) < 1.5;
            float w = same ? exp(falloff * dot(offset, offset)) : 0.0;
            normal += w * other.xy;
            point += w * on;
            width += w * other.w;
            total += w;
        }
    if (total > 0.0) {
        normal = normalize(normal);
        // A corner is no straight edge: only as wide as the circle in the light.
        float corner = total < 2.0 ? 0.71 : 1.0;
        line = vec4(normal, dot(normal, point) / total, corner * width / total);
    }
}
