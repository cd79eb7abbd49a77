// Averages the 16 phases of an interleaved pattern over the pixels of the same surface. Reversed
// infinite depth is linear over the screen for a plane, so a depth gradient predicts neighbours.
#include "interleave_colour.glsl"
#ifdef COLOUR
layout(binding = UNIT_SOURCE) uniform sampler2D interleaved; // as interleave_colour
#else
layout(binding = UNIT_SOURCE) uniform sampler2D interleaved; // V, width of the penumbra, px
#endif

// rgb coloured, a mean visibility; the width of the penumbra.
vec4 load(ivec2 at, out float width)
{
    vec4 v = texelFetch(interleaved, at, 0);
#ifdef COLOUR
    return interleave_split(v, width);
#else
    width = v.g;
    return vec4(v.r);
#endif
}

float depth_at(ivec2 at)
{
    return texelFetch(g_depth, clamp(at, ivec2(0), ivec2(view.viewport.xy) - 1), 0).r;
}

float gradient(float before, float here, float after)
{
    float a = after - here, b = here - before;
    return abs(a) < abs(b) ? a : b;
}

vec4 visibility(Surface s)
{
    float widest;
    vec4 center = load(s.pixel, widest);
    vec2 g =
        vec2(gradient(depth_at(s.pixel - ivec2(1, 0)), s.depth, depth_at(s.pixel + ivec2(1, 0))),
            gradient(depth_at(s.pixel - ivec2(0, 1)), s.depth, depth_at(s.pixel + ivec2(0, 1))));
    vec4 sum = vec4(0.0);
    float weight = 0.0, width;
    ivec2 last = ivec2(view.viewport.xy) - 1;
    // Where the block's corners agree and nothing is in penumbra there is nothing to average.
    float spread = widest;
    for (int i = 0; i < 4; i++) {
        ivec2 corner = s.pixel + ivec2((i & 1) * 4, (i >> 1) * 4) - 2;
        vec4 v = load(clamp(corner, ivec2(0), last), width);
        spread = max(spread, max(width, abs(v.a - center.a)));
    }
    // Five by five with halved borders holds every phase once, and has its centre on the pixel.
    int count = spread > 0.0 ? 25 : 0;
    for (int i = 0; i < count; i++) {
        ivec2 offset = ivec2(i % 5, i / 5) - 2;
        ivec2 at = clamp(s.pixel + offset, ivec2(0), last);
        vec4 v = load(at, width);
        float d = texelFetch(g_depth, at, 0).r;
        float same = abs(d - (s.depth + dot(g, vec2(offset)))) < 0.01 * s.depth ? 1.0 : 0.0;
#ifdef CUBE // other faces' receivers are not in this one's answers
        vec3 p = unproject(light.clip_to_light, pixel_to_ndc(at), max(d, 1e-20));
        same *= max(abs(p.x), abs(p.y)) <= p.z ? 1.0 : 0.0;
#endif
        same *= (abs(offset.x) == 2 ? 0.5 : 1.0) * (abs(offset.y) == 2 ? 0.5 : 1.0);
        sum += same * v;
        weight += same;
        widest = max(widest, same > 0.0 ? width : 0.0);
    }
    vec4 mean = weight > 0.0 ? sum / weight : center;
    vec4 v = mix(center, mean, clamp((widest - 2.0) / 4.0, 0.0, 1.0));
#ifdef COLOUR
    return v;
#else
    return scalar_visibility(v.a);
#endif
}
