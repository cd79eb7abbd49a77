// Whether a pixel may show more than the plane at its centre: along a plane a depth is the mean of
// those on either side. Cheaper than to read all places.
layout(binding = UNIT_DEPTH) uniform sampler2D g_depth;

float depth_at(ivec2 pixel)
{
    return texelFetch(g_depth, pixel, 0).r;
}

bool may_show_edge(ivec2 pixel, ivec2 last)
{
    ivec2 before = max(pixel - 1, ivec2(0)), after = min(pixel + 1, last);
    vec2 low = vec2(depth_at(ivec2(before.x, pixel.y)), depth_at(ivec2(pixel.x, before.y)));
    vec2 high = vec2(depth_at(ivec2(after.x, pixel.y)), depth_at(ivec2(pixel.x, after.y)));
    float depth = depth_at(pixel);
    vec2 bend = abs(low + high - 2.0 * depth), rise = abs(low - high) + 1e-4 * depth;
    return max(bend.x, bend.y) > 0.1 * (rise.x + rise.y);
}
