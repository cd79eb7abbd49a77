// Whether a pixel may show more than the plane at its centre: along a plane a depth is the mean of
// those on either side. Cheaper than to read all places. LAYERED: or more than the plane of the
// blended surface in front.
layout(binding = UNIT_DEPTH) uniform sampler2D g_depth;
#ifdef LAYERED
layout(binding = UNIT_BEFORE) uniform sampler2D front_depth; // of the first blended layer
#endif

float depth_at(ivec2 pixel)
{
    return texelFetch(g_depth, pixel, 0).r;
}

// Of four pixels, and of those beside them.
bvec4 are_bent(vec4 left, vec4 right, vec4 above, vec4 below, vec4 depth)
{
    vec4 bend = max(abs(left + right - 2.0 * depth), abs(above + below - 2.0 * depth));
    vec4 rise = abs(left - right) + abs(above - below) + 2e-4 * depth;
    return greaterThan(bend, 0.1 * rise);
}

bool is_bent(vec2 low, vec2 high, float depth)
{
    return are_bent(vec4(low.x), vec4(high.x), vec4(low.y), vec4(high.y), vec4(depth)).x;
}

#ifdef LAYERED
float front_at(ivec2 pixel)
{
    return max(depth_at(pixel), texelFetch(front_depth, pixel, 0).r);
}
#endif

bool may_show_edge(ivec2 pixel, ivec2 last)
{
    ivec2 before = max(pixel - 1, ivec2(0)), after = min(pixel + 1, last);
    vec2 low = vec2(depth_at(ivec2(before.x, pixel.y)), depth_at(ivec2(pixel.x, before.y)));
    vec2 high = vec2(depth_at(ivec2(after.x, pixel.y)), depth_at(ivec2(pixel.x, after.y)));
    bool bent = is_bent(low, high, depth_at(pixel));
#ifdef LAYERED
    low = vec2(front_at(ivec2(before.x, pixel.y)), front_at(ivec2(pixel.x, before.y)));
    high = vec2(front_at(ivec2(after.x, pixel.y)), front_at(ivec2(pixel.x, after.y)));
    bent = bent || is_bent(low, high, front_at(pixel));
#endif
    return bent;
}
