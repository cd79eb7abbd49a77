// How much a neighbouring pixel belongs to the surface under this one: distance from its plane and
// difference of normals. Needs P(depth_sigma) and P(normal_power).
#include "surface_plane.glsl"

float same_surface(Plane plane, ivec2 at, ivec2 offset)
{
    float away = plane_distance(plane, at, offset);
    float facing = max(dot(octahedral_decode(texelFetch(g_normal, at, 0).xy), plane.normal), 0.0);
    return exp(-0.5 * away * away) * pow(facing, float(P(normal_power)));
}
