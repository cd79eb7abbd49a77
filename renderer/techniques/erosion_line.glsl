// The distance of a pixel from a fitted edge, in half penumbra widths. Needs P(max_radius).
#include "view.glsl"
#include "light.glsl"
#include "surface_plane.glsl"
#include "erosion.def"
layout(binding = UNIT_HARD) uniform sampler2D hard_map;
layout(binding = UNIT_AXES) uniform sampler2D axes_map;
layout(binding = UNIT_LINES) uniform sampler2D lines;

const float FAR = EROSION_FAR; // no edge

// Positive on the lit side. `to`: offset of the edge pixel; `line`: from erosion_lines.frag. Past
// the end of an edge (a corner) the distance grows along it too.
float edge_distance(vec4 line, vec2 to, vec4 axes, Plane plane, bool lit)
{
    if (line.w == 0.0)
        return FAR;
    float across = -dot(line.xy, to) - line.z;
    float along = max(abs(dot(vec2(-line.y, line.x), to)) - 2.0, 0.0);
    // Half width of the light's image across the line (the penumbra's half width, F5), at this
    // pixel; towards the camera a pixel is less of the receiver, away from it more.
    vec2 reach = vec2(dot(axes.xy, line.xy), dot(axes.zw, line.xy));
    float half_width =
        line.w * (light.shape == SHAPE_DISK ? length(reach) : abs(reach.x) + abs(reach.y));
    half_width *= clamp(1.0 - across * dot(plane.gradient, line.xy) / plane.depth, 0.25, 4.0);
    // No edge is looked for farther off, and a ramp that ends before it is done is a seam.
    half_width = min(half_width, float(P(max_radius)) - 1.0);
    // Next to the edge the line decides which side this is, so that the stairs of the hard shadow
    // do not show; farther off, and past the edge's end, the hard shadow does.
    bool outside = abs(across) < 1.5 && along == 0.0 ? across >= 0.0 : lit;
    float t = length(vec2(across, along)) / max(half_width, 1e-3);
    return min(outside ? t : -t, FAR);
}
