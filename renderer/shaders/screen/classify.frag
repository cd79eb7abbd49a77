// One fragment per tile. Every receiver of the tile lies in the frustum slab between the tile's
// nearest and farthest depth; its image in light space bounds q and r_z of all of them.
#include "surface.glsl"
#include "min_max.glsl"
#include "classify.def"
layout(location = 0) out vec4 tile_class; // class / 255, receivers / 255

// A cube's face only owns receivers inside its pyramid, as in screen.frag.
int owned_receivers(ivec2 first, ivec2 end)
{
    int count = 0;
    for (int y = first.y; y < end.y; y++)
        for (int x = first.x; x < end.x; x++) {
            float d = texelFetch(g_depth, ivec2(x, y), 0).r;
            vec3 p = unproject(light.clip_to_light, pixel_to_ndc(ivec2(x, y)), max(d, 1e-20));
            count += d == 0.0 || max(abs(p.x), abs(p.y)) > p.z ? 0 : 1;
        }
    return count;
}

// Whether all of the emitter is above the horizon of every receiver of the tile. What turns away
// from it may be thin or leave no depth in the map, and still sees nothing of the light. `low`,
// `high`: bounds of the receivers.
bool all_face_light(ivec2 first, ivec2 end, vec3 low, vec3 high)
{
    // Most such tiles are flat: one normal, at the worst corner of the bounds.
    vec2 least = vec2(2.0), most = vec2(-1.0);
    for (int y = first.y; y < end.y; y++)
        for (int x = first.x; x < end.x; x++) {
            vec2 e = texelFetch(g_normal, ivec2(x, y), 0).xy;
            least = min(least, e);
            most = max(most, e);
        }
    vec3 n = mat3(light.world_to_light) * octahedral_decode(least);
    vec3 worst = mix(low, high, greaterThan(n, vec3(0.0)));
    if (least == most && light_is_wholly_above_horizon(worst, n))
        return true;
    bool facing = true;
    for (int y = first.y; y < end.y && facing; y++)
        for (int x = first.x; x < end.x; x++) {
            float d = texelFetch(g_depth, ivec2(x, y), 0).r;
            Surface s = surface_at(ivec2(x, y), max(d, 1e-20));
            facing = facing && (d == 0.0 || light_is_wholly_above_horizon(s.p, s.n));
        }
    return facing;
}

float classify_tile(ivec2 first, ivec2 size, out int receivers)
{
    ivec2 end = min(first + classify.tile.x, size);
    float low = 1e30, high = 0.0;
    receivers = 0;
    for (int y = first.y; y < end.y; y++)
        for (int x = first.x; x < end.x; x++) {
            float d = texelFetch(g_depth, ivec2(x, y), 0).r;
            low = min(low, d == 0.0 ? low : d);
            high = max(high, d);
            receivers += d == 0.0 ? 0 : 1;
        }
    if (high == 0.0)
        return TILE_EMPTY;
    // Corners of the slab, half a pixel wider than the pixel centres are.
    vec2 ndc_low = pixel_to_ndc(first) - vec2(1.0, -1.0) * view.viewport.zw;
    vec2 ndc_high = pixel_to_ndc(end - 1) + vec2(1.0, -1.0) * view.viewport.zw;
    vec2 q_low = vec2(1e30), q_high = vec2(-1e30);
    vec3 p_low = vec3(1e30), p_high = vec3(-1e30);
    vec4 nearest_side = vec4(1e30),
         farthest_side = vec4(-1e30); // of a cube face's pyramid, out > 0
    bool behind = false;
    for (int i = 0; i < 8; i++) {
        vec2 ndc =
            vec2((i & 1) != 0 ? ndc_high.x : ndc_low.x, (i & 2) != 0 ? ndc_high.y : ndc_low.y);
        vec3 p = unproject(light.clip_to_light, ndc, (i & 4) != 0 ? high : low);
        p_low = min(p_low, p);
        p_high = max(p_high, p);
        vec4 side = vec4(p.xy, -p.xy) - p.z;
        nearest_side = min(nearest_side, side);
        farthest_side = max(farthest_side, side);
        behind = behind || (light.parallel == 0 && p.z <= light.near_z);
        vec2 q = light_project(p);
        q_low = min(q_low, q);
        q_high = max(q_high, q);
    }
    float near_z = p_low.z, far_z = p_high.z;
    if (light.cube != 0) {
        float rounding = 1e-4 * max(length(p_low), length(p_high));
        bool foreign = any(greaterThan(nearest_side, vec4(rounding))) || p_high.z < -rounding;
        if (foreign && classify.tile.w == 0) {
            receivers = 0;
            return TILE_EMPTY;
        }
        if (classify.tile.w != 0 || any(greaterThan(farthest_side, vec4(-rounding)))) {
            receivers = owned_receivers(first, end);
            return TILE_UNDECIDED;
        }
    }
    if (behind)
        return TILE_UNDECIDED; // beside or behind the light: nothing to project
    vec2 texel = (light.rect.zw - light.rect.xy) / vec2(2 * textureSize(min_max_pyramid, 0));
    vec2 center = 0.5 * (q_low + q_high),
         spread = 0.5 * (q_high - q_low) + classify.margin.x * texel;
    float pixel = view.forward.w / (low * view.eye.w); // m, of the farthest receiver
    spread += classify.margin.y * pixel * (light.parallel != 0 ? 1.0 : light.near_z / near_z);
    vec2 search = light_search_extent(far_z) + spread;
    float slack = 1e-4 * far_z;

    // Cells of the search window, at most 8 x 8 of one level. A cell matters when its nearest depth
    // is in front of the receivers and the filter window of that depth (F3) reaches the cell.
    vec2 size0 = vec2(textureSize(min_max_pyramid, 0));
    vec2 low_uv = clamp(light_uv(center - search), 0.0, 1.0);
    vec2 high_uv = clamp(light_uv(center + search), 0.0, 1.0);
    vec2 span = (high_uv - low_uv) * size0;
    int level = int(ceil(log2(max(max(span.x, span.y) / 7.0, 1.0))));
    ivec2 last = max(ivec2(size0) >> level, ivec2(1)) - 1;
    vec2 scale = size0 * exp2(-float(level));
    ivec2 a = clamp(ivec2(low_uv * scale), ivec2(0), last);
    ivec2 b = clamp(ivec2(high_uv * scale), ivec2(0), last);
    vec2 cell = (light.rect.zw - light.rect.xy) / scale, reach = vec2(0.0);
    bool blocked = false;
    // A method that filters depths over one window looks as far as the nearest caster calls for.
    vec2 widest = vec2(0.0);
    if (classify.tile.z != 0)
        widest = light_filter_extent(min(min_max_window(center, search).x, far_z), far_z);
    for (int y = a.y; y <= b.y; y++)
        for (int x = a.x; x <= b.x; x++) {
            float z = texelFetch(min_max_pyramid, ivec2(x, y), level).r;
            // The last cell of an odd level also holds the leftover column or row.
            vec2 extra = vec2(x == last.x ? cell.x : 0.0, y == last.y ? cell.y : 0.0);
            vec2 middle = light.rect.xy + (vec2(x, y) + 0.5) * cell + 0.5 * extra;
            vec2 gap = abs(middle - center) - 0.5 * (cell + extra) - spread;
            vec2 window = classify.tile.z != 0 ? widest : light_filter_extent(min(z, far_z), far_z);
            if (z < far_z + slack && all(lessThanEqual(gap, window))) {
                blocked = true;
                reach = max(reach, window);
            }
        }
    if (!blocked)
        return all_face_light(first, end, p_low, p_high) ? TILE_LIT : TILE_UNDECIDED;
    // In umbra every texel of every window blocks: the windows must not reach over the map's
    // border, where nothing is, and lie wholly in front of the nearest receiver.
    vec2 window = reach + spread;
    bool inside = all(greaterThan(center - window, light.rect.xy)) &&
                  all(lessThan(center + window, light.rect.zw));
    bool dark = min_max_window(center, window).y < near_z * 0.98 - slack;
    return inside && dark && classify.tile.y != 0 ? TILE_UMBRA : TILE_UNDECIDED;
}

void main()
{
    ivec2 size = ivec2(view.viewport.xy);
    int receivers;
    float found = classify_tile(ivec2(gl_FragCoord.xy) * classify.tile.x, size, receivers);
    tile_class = vec4(found, float(receivers), 0.0, 0.0) / 255.0;
}
