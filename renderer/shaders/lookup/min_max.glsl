// The min-max pyramid of linear depth (passes/map/min_max.c): bounds over windows of the map.
#ifdef MIN_MAX_LAYERED
// Hardware depth of layers, nearest first, so that the first one bounds all: r min, g max, b mean.
// The side is a power of two that may reach over the map's (passes/map/peel.h).
layout(binding = UNIT_MIN_MAX) uniform sampler2DArray min_max_pyramid;

vec2 min_max_at(ivec2 at, int level)
{
    vec2 d = texelFetch(min_max_pyramid, ivec3(at, 0), level).rg;
    return vec2(d.x < 1.0 ? light_linear(d.x) : 1e30, d.y < 1.0 ? light_linear(d.y) : 1e30);
}

vec2 min_max_size() // of the map, in texels of level 0
{
    return 0.5 * vec2(textureSize(caster_maps, 0).xy);
}
#else
layout(binding = UNIT_MIN_MAX) uniform sampler2D min_max_pyramid; // r min, g max, z in m

vec2 min_max_at(ivec2 at, int level)
{
    return texelFetch(min_max_pyramid, at, level).rg;
}

vec2 min_max_size()
{
    return vec2(textureSize(min_max_pyramid, 0));
}
#endif

// Bounds of the map's linear depth over the window q +- extent (m on the map plane), from at most
// 2 x 2 texels of the level that is coarse enough. Where nothing is: 1e30.
vec2 min_max_window(vec2 q, vec2 extent)
{
    vec2 size = min_max_size();
    vec2 low = clamp(light_uv(q - extent), 0.0, 1.0), high = clamp(light_uv(q + extent), 0.0, 1.0);
    vec2 span = (high - low) * size;
    // The last level is a single texel, also where the side is no power of two.
    int level = int(ceil(log2(max(max(span.x, span.y), 1.0))));
    level = min(level, textureQueryLevels(min_max_pyramid) - 1);
    ivec2 last = max(textureSize(min_max_pyramid, 0).xy >> level, ivec2(1)) - 1;
    vec2 scale = size * exp2(-float(level));
    ivec2 a = clamp(ivec2(low * scale), ivec2(0), last),
          b = clamp(ivec2(high * scale), ivec2(0), last);
    vec2 v0 = min_max_at(a, level);
    vec2 v1 = min_max_at(ivec2(b.x, a.y), level);
    vec2 v2 = min_max_at(ivec2(a.x, b.y), level);
    vec2 v3 = min_max_at(b, level);
    return vec2(min(min(v0.x, v1.x), min(v2.x, v3.x)), max(max(v0.y, v1.y), max(v2.y, v3.y)));
}

// The half extent within which every blocker of the receiver lies: F4 starts from the near plane,
// and the nearest depth inside a window shrinks it (F3). Two rounds; never less than `least`.
// nearest_z: the nearest depth inside the result; when it is behind the receiver nothing blocks.
vec2 min_max_search_extent(vec2 q, float receiver_z, vec2 least, out float nearest_z)
{
    vec2 extent = max(light_search_extent(receiver_z), least);
    for (int i = 0; i < 2; i++) {
        nearest_z = min_max_window(q, extent).x;
        float z = min(nearest_z, receiver_z);
        extent = max(min(extent, light_filter_extent(z, receiver_z)), least);
    }
    return extent;
}
