// How little a neighbouring pixel belongs to the surface under this one, by its distance from the
// plane and the difference of normals: its weight is the exponential of minus this. Needs
// P(depth_sigma) and P(normal_power).
#include "surface_plane.glsl"

float surface_difference(Plane plane, ivec2 at, ivec2 offset)
{
    float away = plane_distance(plane, at, offset);
    float facing = dot(octahedral_decode(texelFetch(g_normal, at, 0).xy), plane.normal);
    // Next to facing^power where that is not small.
    return 0.5 * away * away + float(P(normal_power)) * (1.0 - facing);
}
