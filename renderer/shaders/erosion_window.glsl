// F2 and F3 with the distance of the map plane moved from W to the extent: it differs from face to
// face of a cube.
float window_scale(float caster_z, float receiver_z)
{
    return light_window_scale(caster_z, receiver_z) / (light_parallel ? 1.0 : light.near_z);
}

#define window_extent (light.extent * (light_parallel ? 1.0 : light.near_z))
