// While the scene moves pixels rest on few samples, the same ones all around, and a penumbra is as
// many steps. Each sample stands for a part of the light: the mean over that part's image on the
// receiver is the slope between the steps. Pixels with more samples have a smaller one.
#include "temporal.glsl"
layout(binding = UNIT_DEPTH) uniform sampler2D g_depth;
layout(binding = UNIT_NORMAL) uniform sampler2D g_normal;
layout(binding = UNIT_FRESH) uniform sampler2D means;
layout(binding = UNIT_LAST_STATE) uniform sampler2D states;
layout(binding = UNIT_PENUMBRA) uniform sampler2D spread_map; // see penumbra_estimate.glsl
layout(location = 0) out vec4 mean;

#define TAPS 3         // to each side
#define DEVIATION 0.54 // that spread_map has, of half a penumbra

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = ivec2(view.viewport.xy) - 1;
    vec4 state = texelFetch(states, pixel, 0), spread = texelFetch(spread_map, pixel, 0);
    mean = texelFetch(means, pixel, 0);
    if (mean.a <= 0.0 || state.x <= 0.0)
        return;
    float scale = temporal.fresh.z / (DEVIATION * sqrt(state.x));
    vec2 across = vec2(scale * spread.y, 0.0), along = scale * spread.w * vec2(spread.z, 1.0);
    if (max(abs(across.x), abs(along.y)) < 0.5)
        return;
    Receiver r = receiver_at(pixel, state.y, state.zw);
    float weights = float((TAPS + 1) * (TAPS + 1));
    mean *= weights;
    for (int y = -TAPS; y <= TAPS; y++)
        for (int x = -TAPS; x <= TAPS; x++) {
            ivec2 off = ivec2(round((float(x) * across + float(y) * along) / float(TAPS))),
                  at = pixel + off;
            if (off == ivec2(0) || any(lessThan(at, ivec2(0))) || any(greaterThan(at, last)))
                continue;
            vec4 other = texelFetch(means, at, 0);
            if (other.a <= 0.0 || !is_same_surface(r, view.clip_to_world, view.forward.w, at,
                                      texelFetch(states, at, 0)))
                continue;
            float weight = float((TAPS + 1 - abs(x)) * (TAPS + 1 - abs(y)));
            mean += weight * other;
            weights += weight;
        }
    mean /= weights;
}
