// One layer of the answer. LAYER: the function that draws it, layer_ and the name that it has in
// protocol/layers.def. RAW: true: physical values for float files; false: values that fit an 8-bit
// image.
#include "view.glsl"
#include "octahedral.glsl"
#include "display.glsl"
#include "output.def"

layout(binding = UNIT_DEPTH) uniform sampler2D g_depth;
layout(binding = UNIT_NORMAL) uniform sampler2D g_normal;
layout(binding = UNIT_ALBEDO) uniform sampler2D g_albedo;
layout(binding = UNIT_SURFACE) uniform sampler2D g_surface;
// Sum of beauty, visibility, classes, variance.
layout(binding = UNIT_SOURCE) uniform sampler2D accumulated;

layout(location = 0) out vec4 color;

ivec2 pixel;
bool hit; // shows a surface; everything of one is 0 where none is
float depth;

vec3 surface_position()
{
    return hit ? unproject(view.clip_to_world, pixel_to_ndc(pixel), depth) : vec3(0.0);
}

vec4 grey(float v)
{
    return vec4(vec3(v), 1.0);
}

vec4 layer_beauty()
{
    // Multiplied by alpha, as EXR has it; files of integers hold the colour as it is.
    vec4 sum = texelFetch(accumulated, pixel, 0) * range.shadings.y;
    if (RAW)
        return vec4(sum.rgb * view.display.x, sum.a);
    return sum.a > 0.0 ? vec4(display_encode(sum.rgb / sum.a), sum.a) : vec4(0.0);
}

vec4 layer_visibility()
{
    return texelFetch(accumulated, pixel, 0) * range.shadings.y;
}

vec4 layer_penumbra()
{
    float v = texelFetch(accumulated, pixel, 0).a * range.shadings.y;
    float kind = v >= 0.999 ? 0.0 : v <= 0.001 ? 2.0 : 1.0;
    return grey(RAW ? kind : 0.5 * kind);
}

vec4 layer_depth()
{
    float distance = hit ? dot(surface_position() - view.eye.xyz, view.forward.xyz) : 0.0;
    float shown = (distance - range.bounds_min.w) / (range.bounds_max.w - range.bounds_min.w);
    return grey(RAW ? distance : hit ? clamp(shown, 0.0, 1.0) : 1.0);
}

vec4 layer_normal()
{
    vec3 n = hit ? octahedral_decode(texelFetch(g_normal, pixel, 0).zw) : vec3(0.0);
    return vec4(RAW ? n : hit ? 0.5 * n + 0.5 : vec3(0.5), 1.0);
}

vec4 layer_albedo()
{
    vec3 albedo = hit ? texelFetch(g_albedo, pixel, 0).rgb : vec3(0.0);
    albedo *= albedo;
    return vec4(RAW ? albedo : srgb_encode(albedo), 1.0);
}

vec4 layer_position()
{
    vec3 p = surface_position(), size = range.bounds_max.xyz - range.bounds_min.xyz;
    vec3 shown = clamp((p - range.bounds_min.xyz) / max(size, 1e-20), 0.0, 1.0);
    return vec4(RAW ? (hit ? p + range.origin.xyz : vec3(0.0)) : hit ? shown : vec3(0.0), 1.0);
}

vec4 layer_classes()
{
    // Proved lit 0 or in umbra 2 in every light and frame; else undecided 1.
    vec2 proved = texelFetch(accumulated, pixel, 0).rg;
    float kind = proved.x >= range.shadings.x ? 0.0 : proved.y >= range.shadings.x ? 2.0 : 1.0;
    return grey(RAW ? kind : 0.5 * kind);
}

vec4 layer_error()
{
    // Standard error of a mean of independent estimates.
    float error = sqrt(texelFetch(accumulated, pixel, 0).r) / max(range.shadings.x, 1.0);
    return grey(RAW ? error : min(10.0 * error, 1.0));
}

void main()
{
    pixel = ivec2(gl_FragCoord.xy);
    depth = texelFetch(g_depth, pixel, 0).r;
    hit = depth != 0.0;
    color = LAYER();
}
