// What the min-max pyramid proves of a whole window of the map against the receiver's plane.
#include "min_max.glsl"

const int WINDOW_MIXED = 0, WINDOW_LIT = 1, WINDOW_BLOCKED = 2;

// The window q +- extent is walked in at most 4 x 4 aligned texels of the pyramid, each against the
// plane at its own near corner, so that a tilted receiver is lit by its own depths, however wide
// the window. Blockers nearer to the plane than its slope over one such texel are not told from it.
// Blocked: everything is `margin` metres before the plane.
int window_class(vec2 q, vec2 extent, ReceiverPlane plane, float bias, float margin, vec2 map_size)
{
    vec2 low = light_uv(q - extent) * map_size, high = light_uv(q + extent) * map_size;
    bool inside = all(greaterThanEqual(low, vec2(0.0))) && all(lessThanEqual(high, map_size));
    bool outside = any(greaterThan(low, map_size)) || any(lessThan(high, vec2(0.0)));
    low = clamp(low, vec2(0.0), map_size);
    high = clamp(high, vec2(0.0), map_size);
    vec2 span = high - low;
    int level = int(ceil(log2(max(max(span.x, span.y) / 6.0, 1.0)))); // texel: 2^(level + 1)
    level = min(level, textureQueryLevels(min_max_pyramid) - 1);
    ivec2 last = max(textureSize(min_max_pyramid, 0) >> level, ivec2(1)) - 1;
    float side = exp2(float(level + 1));
    ivec2 a = clamp(ivec2(low / side), ivec2(0), last),
          b = clamp(ivec2(high / side), ivec2(0), last);
    vec2 metres = (light.rect.zw - light.rect.xy) / map_size;
    bool lit = true, blocked = inside;
    if (outside)
        b.y = a.y - 1;
    for (int y = a.y; y <= b.y; y++)
        for (int x = a.x; x <= b.x; x++) {
            ivec2 at = ivec2(x, y);
            vec2 from = vec2(at) * side;
            vec2 to = mix(from + side, map_size, equal(at, last)); // takes the odd rest too
            vec2 offset = light.rect.xy + 0.5 * (from + to) * metres - q;
            float near = plane.depth + dot(plane.gradient, offset) -
                         dot(abs(plane.gradient), 0.5 * (to - from) * metres);
            float near_z = light_linear(min(near, 1.0 - 1e-6) - bias);
            vec2 z = texelFetch(min_max_pyramid, at, level).rg;
            lit = lit && z.x >= near_z;
            blocked = blocked && z.y < near_z - margin;
        }
    return outside || lit ? WINDOW_LIT : blocked ? WINDOW_BLOCKED : WINDOW_MIXED;
}
