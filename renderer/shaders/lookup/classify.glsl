// Windows of the map in which nothing or everything blocks, found without looking at a single
// depth.
#include "depth_unit.glsl"
#include "min_max.glsl"

// Compares some 4 x 4 texels of the pyramid over q +- extent with the receiver's plane, each by
// itself: on a slope the bounds of the whole window would say little.
void classify_window(
    vec2 q, vec2 extent, ReceiverPlane plane, float bias, out bool lit, out bool blocked)
{
    vec2 size = vec2(textureSize(min_max_pyramid, 0));
    vec2 low = clamp(light_uv(q - extent), 0.0, 1.0) * size;
    vec2 high = clamp(light_uv(q + extent), 0.0, 1.0) * size;
    int level = int(max(ceil(log2(max(high.x - low.x, high.y - low.y) * 0.25)), 0.0));
    ivec2 last = max(ivec2(size) >> level, ivec2(1)) - 1;
    vec2 step = vec2(exp2(float(level)));
    ivec2 a = min(ivec2(low / step), last), b = min(ivec2(high / step), last);
    vec2 texel = (light.rect.zw - light.rect.xy) / size * step, origin = light.rect.xy - q;
    lit = true;
    blocked = all(equal(clamp(q, light.rect.xy + extent, light.rect.zw - extent), q));
    for (int y = a.y; y <= b.y; y++)
        for (int x = a.x; x <= b.x; x++) {
            vec2 range = texelFetch(min_max_pyramid, ivec2(x, y), level).rg;
            PlaneInWindow t =
                plane_in_window(plane, (vec2(x, y) + 0.5) * texel + origin, 0.5 * texel, bias);
            lit = lit && depth_unit_of_z(range.x) >= t.lowest;
            blocked = blocked && depth_unit_of_z(range.y) < t.lowest;
        }
}
