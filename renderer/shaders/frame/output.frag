// One layer of the answer. LAYER: as enum pen_layer. RAW: physical values for float files; else
// values that fit an 8-bit image.
#include "view.glsl"
#include "octahedral.glsl"
#include "display.glsl"

layout(binding = 0) uniform sampler2D g_depth;
layout(binding = 1) uniform sampler2D g_normal;
layout(binding = 2) uniform sampler2D g_albedo;
layout(binding = 7) uniform sampler2D accumulated; // sum of beauty, visibility, classes, variance
layout(std140, binding = 3) uniform OutputBlock {
    vec4 bounds_min; // world; w: nearest view distance shown
    vec4 bounds_max; // w: farthest
    vec4 shadings;   // x: lights times frames
} range;

layout(location = 0) out vec4 color;

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float depth = texelFetch(g_depth, pixel, 0).r;
    bool hit = depth != 0.0;
    vec3 p = hit ? unproject(view.clip_to_world, pixel_to_ndc(pixel), depth) : vec3(0.0);
    float distance = hit ? dot(p - view.eye.xyz, view.forward.xyz) : 0.0;
    vec3 n = hit ? octahedral_decode(texelFetch(g_normal, pixel, 0).zw) : vec3(0.0);
    vec3 albedo = hit ? texelFetch(g_albedo, pixel, 0).rgb : vec3(0.0);
    albedo *= albedo;
#if LAYER == 0
    vec3 sum = texelFetch(accumulated, pixel, 0).rgb;
#ifdef RAW
    color = vec4(sum * view.display.x, 1.0);
#else
    color = vec4(display_encode(sum), 1.0);
#endif
#elif LAYER == 1
    color = texelFetch(accumulated, pixel, 0);
#elif LAYER == 2
    // Penumbra class from the mean visibility: lit 0, penumbra 1, umbra 2.
    float v = texelFetch(accumulated, pixel, 0).a;
    float kind = v >= 0.999 ? 0.0 : v <= 0.001 ? 2.0 : 1.0;
#ifdef RAW
    color = vec4(vec3(kind), 1.0);
#else
    color = vec4(vec3(0.5 * kind), 1.0);
#endif
#elif LAYER == 3
#ifdef RAW
    color = vec4(vec3(distance), 1.0);
#else
    float shown = (distance - range.bounds_min.w) / (range.bounds_max.w - range.bounds_min.w);
    color = vec4(vec3(hit ? clamp(shown, 0.0, 1.0) : 1.0), 1.0);
#endif
#elif LAYER == 4
#ifdef RAW
    color = vec4(n, 1.0);
#else
    color = vec4(hit ? 0.5 * n + 0.5 : vec3(0.5), 1.0);
#endif
#elif LAYER == 5
#ifdef RAW
    color = vec4(albedo, 1.0);
#else
    color = vec4(srgb_encode(albedo), 1.0);
#endif
#elif LAYER == 7
    // Proved lit 0 or in umbra 2 in every light and frame; else undecided 1.
    vec2 proved = texelFetch(accumulated, pixel, 0).rg;
    float kind = proved.x >= range.shadings.x ? 0.0 : proved.y >= range.shadings.x ? 2.0 : 1.0;
#ifdef RAW
    color = vec4(vec3(kind), 1.0);
#else
    color = vec4(vec3(0.5 * kind), 1.0);
#endif
#elif LAYER == 8
    // Standard error of a mean of independent estimates.
    float error = sqrt(texelFetch(accumulated, pixel, 0).r) / max(range.shadings.x, 1.0);
#ifdef RAW
    color = vec4(vec3(error), 1.0);
#else
    color = vec4(vec3(min(10.0 * error, 1.0)), 1.0);
#endif
#else
#ifdef RAW
    color = vec4(p, 1.0);
#else
    color = vec4(hit ? clamp((p - range.bounds_min.xyz) /
        max(range.bounds_max.xyz - range.bounds_min.xyz, 1e-6), 0.0, 1.0) : vec3(0.0), 1.0);
#endif
#endif
}
