// How much of the sky a surface sees past what is near it on the screen: horizons along slices
// through the depth buffer, the arc between them integrated in closed form (Jimenez et al. 2016,
// practical real-time strategies for accurate indirect occlusion). Half the picture's resolution;
// the slices turn in a 4 x 4 pattern that occlusion_blur.frag averages away. The depth goes along,
// so that who looks for texels of the same surface looks up once. LAYER: what is solid stands
// around a blended layer too.
#include "view.glsl"
#include "octahedral.glsl"
#include "occlusion.def"

layout(binding = UNIT_DEPTH) uniform sampler2D g_depth;
layout(binding = UNIT_NORMAL) uniform sampler2D g_normal;
#ifdef LAYER
layout(binding = UNIT_SOLID) uniform sampler2D depth_solid;
#endif

layout(location = 0) out vec2 open; // share of the sky, depth

const int SLICES = 2, STEPS = 4;

// In front of the eye: x to the right, y up, z along the view, m.
vec3 in_view(ivec2 pixel, float depth)
{
    vec2 centred = vec2(pixel) + 0.5 - 0.5 * view.viewport.xy;
    float z = view.forward.w / depth;
    return vec3(vec2(centred.x, -centred.y) * (z / view.eye.w), z);
}

float arc(float h, float n, float cos_n, float sin_n)
{
    return 0.25 * (cos_n - cos(2.0 * h - n) + 2.0 * h * sin_n);
}

void main()
{
    ivec2 at = ivec2(gl_FragCoord.xy), size = ivec2(view.viewport.xy);
    ivec2 pixel = min(2 * at + 1, size - 1);
    float depth = texelFetch(g_depth, pixel, 0).r;
    open = vec2(1.0, depth);
    if (depth == 0.0)
        return;
    vec3 forward = view.forward.xyz;
    vec3 right = normalize(cross(
        forward, vec3(view.world_to_clip[0].y, view.world_to_clip[1].y, view.world_to_clip[2].y)));
    vec3 up = cross(right, forward);
    vec3 world = octahedral_decode(texelFetch(g_normal, pixel, 0).xy);
    vec3 n = vec3(dot(world, right), dot(world, up), dot(world, forward));
    vec3 p = in_view(pixel, depth), v = -normalize(p);
    float reach = min(occlusion.reach.x * view.eye.w / p.z, occlusion.reach.y);
    int turn = (at.x & 3) | (at.y & 3) << 2;
    float phase = float((turn * 7) & 15) / 16.0, offset = float((turn * 11 + 3) & 15) / 16.0;
    float sum = 0.0;
    for (int slice = 0; slice < SLICES; slice++) {
        float angle = 3.14159265 * (float(slice) + phase) / float(SLICES);
        vec2 along = vec2(cos(angle), sin(angle));
        vec3 axis = normalize(cross(vec3(along, 0.0), v));
        vec3 flat_n = n - axis * dot(n, axis);
        vec3 tangent = vec3(along, 0.0) - v * dot(vec3(along, 0.0), v);
        float share = max(length(flat_n), 1e-4);
        float cos_n = clamp(dot(flat_n, v) / share, -1.0, 1.0);
        float turned = (dot(tangent, flat_n) < 0.0 ? -1.0 : 1.0) * acos(cos_n), sin_n = sin(turned);
        vec2 highest = vec2(-1.0);
        for (int i = 0; i < 2 * STEPS; i++) {
            float t = (float(i >> 1) + 0.25 + 0.75 * offset) / float(STEPS);
            float side = (i & 1) == 0 ? 1.0 : -1.0;
            vec2 moved = along * side * (t * t * reach + 1.5);
            ivec2 q = pixel + ivec2(round(moved.x), -round(moved.y));
            float there = texelFetch(g_depth, clamp(q, ivec2(0), size - 1), 0).r;
#ifdef LAYER
            there = max(there, texelFetch(depth_solid, clamp(q, ivec2(0), size - 1), 0).r);
#endif
            vec3 to = in_view(q, max(there, 1e-20)) - p;
            float far2 = dot(to, to);
            // Beyond the radius nothing counts; towards it the horizon sinks.
            float fade = clamp(far2 / (occlusion.reach.x * occlusion.reach.x), 0.0, 1.0);
            float cosine = mix(dot(to, v) * inversesqrt(max(far2, 1e-20)), -1.0, fade);
            if (there == 0.0 || q != clamp(q, ivec2(0), size - 1))
                cosine = -1.0;
            highest = max(highest, (i & 1) == 0 ? vec2(cosine, -1.0) : vec2(-1.0, cosine));
        }
        vec2 horizon = vec2(1.0, -1.0) * acos(clamp(highest, -1.0, 1.0));
        horizon = turned + clamp(horizon - turned, -1.57079633, 1.57079633);
        sum +=
            share * (arc(horizon.x, turned, cos_n, sin_n) + arc(horizon.y, turned, cos_n, sin_n));
    }
    open.x = clamp(sum / float(SLICES), 0.0, 1.0);
}
