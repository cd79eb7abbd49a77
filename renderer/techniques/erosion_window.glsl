// F2 and F3 with the distance of the map plane moved from W to the extent: it differs from face to
// face of a cube. W is kept near 1 by a length of the light, since half floats hold it.
#include "erosion_window.def"

#define window_unit (light_parallel ? unit.length.x : light.near_z / unit.length.x)
#define window_extent (light.extent * window_unit)

float window_scale(float caster_z, float receiver_z)
{
    return light_window_scale(caster_z, receiver_z) / window_unit;
}
