// At each edge pixel the straight line that fits the boundary best (total least squares over the
// midpoints between shadowed and lit neighbours): (unit normal towards the light, distance of the
// line from the pixel's centre along it, W). Needs P(fit_radius).
#include "view.glsl"
#include "erosion.def"
layout(binding = UNIT_EDGES) uniform sampler2D edges;
layout(location = 0) out vec4 line;

// Sums of weight, position and outer products of the boundary points of the edge pixel at `offset`.
void add_pixel(
    vec2 edge, vec2 offset, float weight, inout vec3 first, inout vec3 second, inout vec2 outward)
{
    uint bits = uint(edge.x);
    for (uint k = 0u; k < 4u; k++) {
        vec2 side = vec2(k < 2u ? 1.0 : 0.0, k < 2u ? 0.0 : 1.0) * ((k & 1u) == 0u ? 1.0 : -1.0);
        float w = (bits >> k & 1u) != 0u ? weight : 0.0;
        vec2 p = offset + 0.5 * side;
        first += w * vec3(1.0, p);
        second += w * vec3(p * p, p.x * p.y);
        outward += w * side;
    }
}

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = ivec2(view.viewport.xy) - 1;
    vec2 own = texelFetch(edges, pixel, 0).rg;
    vec3 first = vec3(0.0), second = vec3(0.0);
    vec2 outward = vec2(0.0), own_side = vec2(0.0);
    add_pixel(own, vec2(0.0), 1.0, first, second, own_side);
    outward = own_side;
    int r = own.x > 0.0 ? int(P(fit_radius)) : -1;
    float falloff = -0.5 / (0.36 * float(P(fit_radius) * P(fit_radius)));
    for (int y = -r; y <= r; y++)
        for (int x = -r; x <= r; x++) {
            ivec2 at = clamp(pixel + ivec2(x, y), ivec2(0), last);
            vec2 edge = texelFetch(edges, at, 0).rg, offset = vec2(at - pixel);
            vec2 side = vec2(0.0);
            vec3 f = vec3(0.0), s = vec3(0.0);
            add_pixel(edge, offset, exp(falloff * dot(offset, offset)), f, s, side);
            // The far side of a thin shadow and edges of other casters are other lines.
            bool same =
                dot(side, own_side) > 0.0 && abs(edge.y - own.y) < 0.25 * own.y && at != pixel;
            first += same ? f : vec3(0.0);
            second += same ? s : vec3(0.0);
            outward += same ? side : vec2(0.0);
        }
    if (own.x == 0.0) {
        line = vec4(0.0);
        return;
    }
    vec2 mean = first.yz / first.x;
    vec3 c = second / first.x - vec3(mean * mean, mean.x * mean.y);
    // The normal is the direction of least variance.
    float angle = 0.5 * atan(2.0 * c.z, c.x - c.y);
    vec2 normal = vec2(-sin(angle), cos(angle));
    if (dot(normal, outward) < 0.0)
        normal = -normal;
    line = vec4(normal, dot(normal, mean), own.y);
}
